// Words, units, colours: what all other scripts use. Times are in ns.
(function (mauve) {
  "use strict";

  const NARROW = "\u202f";
  const UNITS = [["s", 1e9], ["ms", 1e6], ["\u00b5s", 1e3], ["ns", 1]];

  function digits(value) {
    const size = Math.abs(value);
    if (size >= 1000) return Math.round(value).toLocaleString("en-US");
    if (Number.isInteger(value)) return String(value);
    return value.toFixed(size < 10 ? 2 : size < 100 ? 1 : 0);
  }

  // A time of three digits at least, with its unit.
  mauve.timeText = function (ns) {
    if (ns === null || ns === undefined) return "\u2013";
    if (ns === 0) return "0" + NARROW + "\u00b5s";
    const size = Math.abs(ns);
    if (size >= 120e9) {
      const seconds = Math.round(size / 1e9);
      const minutes = Math.floor(seconds / 60);
      const text =
        minutes < 120
          ? minutes + NARROW + "min" + NARROW + (seconds % 60) + NARROW + "s"
          : Math.floor(minutes / 60) + NARROW + "h" + NARROW + (minutes % 60) + NARROW + "min";
      return ns < 0 ? "\u2212" + text : text;
    }
    const [unit, factor] = UNITS.find((pair) => size >= pair[1]) || UNITS[3];
    return (digits(ns / factor) + NARROW + unit).replace("-", "\u2212");
  };

  // An instant, as exact as a view of this span needs it.
  mauve.instantText = function (ns, span) {
    const decimals = Math.min(9, Math.max(0, 12 - Math.floor(Math.log10(Math.max(span, 1)))));
    return (ns / 1e9).toFixed(decimals).replace("-", "\u2212") + NARROW + "s";
  };

  mauve.countText = (count, what) =>
    Math.round(count).toLocaleString("en-US") + " " + what + (Math.round(count) === 1 ? "" : "s");

  mauve.shareText = (share) =>
    (share > 0 && share < 1e-4 ? "< 0.01" : digits(100 * share)) + NARROW + "%";

  mauve.element = function (name, css, text) {
    const made = document.createElement(name);
    if (css) made.className = css;
    if (text !== undefined) made.textContent = text;
    return made;
  };

  // The page's colours as they are in the present theme.
  mauve.readColours = function () {
    const probe = mauve.element("i");
    document.body.append(probe);
    const read = function (name) {
      probe.style.color = "var(--" + name + ")";
      return getComputedStyle(probe).color;
    };
    const colours = { states: [0, 1, 2, 3, 4, 5, 6, 7].map((index) => read("s" + index)) };
    for (const name of ["ink", "muted", "line", "panel", "faint", "accent", "good", "bad", "attention", "swap"]) {
      colours[name] = read(name);
    }
    probe.remove();
    return colours;
  };
})((window.mauve = window.mauve || {}));
