// Unpacks the columns that columns.py packed: base64, deflate, byte planes, differences.
(function (mauve) {
  "use strict";

  const VIEWS = { u1: Uint8Array, u2: Uint16Array, i4: Int32Array, f8: Float64Array, float: Float64Array };

  async function inflated(base64) {
    const text = atob(base64);
    const packed = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Bytes of values, from all first bytes, all second bytes, ...
  function unplaned(planes, at, length, size) {
    const bytes = new Uint8Array(length * size);
    for (let plane = 0; plane < size; plane++) {
      const from = at + plane * length;
      for (let i = 0; i < length; i++) bytes[i * size + plane] = planes[from + i];
    }
    return bytes.buffer;
  }

  // Returns an array of Float64Array, one for each description [type, length, first value or null].
  mauve.unpackColumns = async function (described, base64) {
    const planes = described.length ? await inflated(base64) : new Uint8Array(0);
    let at = 0;
    return described.map(function ([type, length, first]) {
      const View = VIEWS[type];
      const size = View.BYTES_PER_ELEMENT;
      const stored = new View(unplaned(planes, at, length, size));
      at += length * size;
      const values = Float64Array.from(stored);
      if (first !== null) {
        let value = first;
        for (let i = 0; i < length; i++) values[i] = value += values[i];
      }
      return values;
    });
  };
})((window.mauve = window.mauve || {}));
