// Curves of values: on the timeline's axis, in its view, under its cursor.
(function (mauve) {
  "use strict";

  const AXIS_ROOM = 24; // px
  const ROW = 72;
  const PAD = 13; // px between a curve and its row's edge, for a label
  const DIGITS = 6;

  mauve.numberText = (value) => String(Number(value.toPrecision(DIGITS))).replaceAll("-", "\u2212");

  // Samples of one value by time. An entry of number > 1 stands for several, between low and high.
  class Curve {
    constructor(described, columns) {
      this.name = described.name;
      this.time = columns[described.time];
      this.number = columns[described.number];
      this.low = columns[described.low];
      this.high = columns[described.high];
    }

    last(time) {
      return mauve.lastAtOrBefore(this.time, time);
    }

    // In words, the value that holds at an instant.
    text(time) {
      const at = this.last(time);
      if (at < 0) return "\u2013";
      if (Number.isNaN(this.low[at])) return "no number";
      const low = mauve.numberText(this.low[at]);
      return this.number[at] === 1 ? low : low + " to " + mauve.numberText(this.high[at]);
    }

    // Smallest and largest value of an interval; null without any.
    span(first, last) {
      let low = Infinity;
      let high = -Infinity;
      for (let i = first; i <= last; i++) {
        if (this.low[i] < low) low = this.low[i];
        if (this.high[i] > high) high = this.high[i];
      }
      return low > high ? null : { low, high };
    }
  }

  class Values {
    constructor(root, timeline, described, columns) {
      this.timeline = timeline;
      this.plot = root.querySelector(".plot");
      this.canvas = this.plot.querySelector("canvas");
      this.curves = described.curves.map((one) => new Curve(one, columns));
      this.outputs = [...root.querySelectorAll("output")];
      root.style.setProperty("--row", ROW + "px");
      root.style.setProperty("--axis", AXIS_ROOM + "px");
      new ResizeObserver(() => this.resize()).observe(this.plot);
      this.resize();
      timeline.listeners.push(() => this.draw());
      timeline.pointed.push(() => this.showValues());
    }

    get height() {
      return AXIS_ROOM + ROW * this.curves.length;
    }

    resize() {
      this.context = mauve.fitted(this.canvas, this.plot.clientWidth, this.height);
      this.draw();
    }

    draw() {
      const { context, timeline } = this;
      const width = this.plot.clientWidth;
      const { colours, model, view } = timeline;
      if (!width) return;
      const scale = new mauve.Scale(view, width);
      context.clearRect(0, 0, width, this.height);
      mauve.drawAxis(context, { offset: model.offset, bucket: 0 }, scale, this.height, colours);
      drawEvents(context, model, scale, this.height, colours);
      this.curves.forEach((curve, index) => drawRow(context, curve, AXIS_ROOM + index * ROW, scale, model, colours));
      this.showValues();
    }

    // The values at the cursor.
    showValues() {
      const time = this.timeline.pointer;
      this.curves.forEach((curve, i) => (this.outputs[i].textContent = time === null ? "\u2013" : curve.text(time)));
    }

    // The curve at a height of the plot.
    at(y) {
      return this.curves[Math.floor((y - AXIS_ROOM) / ROW)];
    }
  }

  function drawEvents(context, model, scale, height, colours) {
    for (const swap of model.swaps) {
      const x = scale.x(swap.parked);
      const width = Math.max(1.5, (swap.armed - swap.parked) * scale.perNs);
      if (x + width < 0 || x > scale.width) continue;
      context.fillStyle = colours.swap;
      context.globalAlpha = width > 3 ? 0.2 : 0.6;
      context.fillRect(x, AXIS_ROOM - 4, width, height);
    }
    context.fillStyle = colours.bad;
    context.globalAlpha = 0.8;
    for (const row of model.rows) {
      for (const { kind, time } of row.markers) {
        if (kind === "fault") for (const at of time) context.fillRect(scale.x(at) - 0.75, AXIS_ROOM - 4, 1.5, height);
      }
    }
    context.globalAlpha = 1;
  }

  function drawRow(context, curve, top, scale, model, colours) {
    const end = Math.min(scale.time(scale.width), Math.max(model.duration, curve.time[curve.time.length - 1]));
    const first = Math.max(curve.last(scale.begin), 0);
    const last = curve.last(end);
    context.fillStyle = colours.line;
    context.fillRect(0, top + ROW - 1, scale.width, 1);
    const span = last < first ? null : curve.span(first, last);
    if (!span) return;
    const room = ROW - 2 * PAD - 1;
    const halfSpan = span.high / 2 - span.low / 2; // the whole difference may be infinite
    const flat = halfSpan === 0;
    const bottom = flat ? top + PAD + room / 2 : top + PAD + room;
    const y = (value) => bottom - (flat ? 0 : ((value / 2 - span.low / 2) / halfSpan) * room);
    context.strokeStyle = colours.accent;
    context.fillStyle = colours.accent;
    context.lineWidth = 1.4;
    context.lineJoin = "round";
    drawCurve(context, curve, first, last, scale, y, end);
    drawEnds(context, span, flat, top, bottom, colours);
  }

  // A step from each value to the next; entries within one pixel are drawn as their range, merged ones as a box.
  function drawCurve(context, curve, first, last, scale, y, end) {
    const { time, number, low, high } = curve;
    let open = false;
    context.beginPath();
    for (let i = first; i <= last; ) {
      const x = Math.max(scale.x(time[i]), -5);
      let next = i + 1;
      let [least, most] = [low[i], high[i]];
      while (next <= last && scale.x(time[next]) < x + 0.7) {
        if (low[next] < least || Number.isNaN(least)) least = low[next];
        if (high[next] > most || Number.isNaN(most)) most = high[next];
        next++;
      }
      const until = next < time.length ? Math.min(time[next], end) : end;
      const right = Math.min(scale.x(until), scale.width + 5);
      if (Number.isNaN(least)) {
        open = false;
      } else if (number[next - 1] > 1 && right - x > 1) {
        context.globalAlpha = 0.55;
        context.fillRect(x, y(most) - 0.7, right - x, y(least) - y(most) + 1.4);
        context.globalAlpha = 1;
        open = false;
      } else {
        const held = high[next - 1];
        if (open) context.lineTo(x, y(least));
        else context.moveTo(x, y(least));
        if (most !== least) context.lineTo(x, y(most));
        open = !Number.isNaN(held);
        if (open && next - i > 1) context.lineTo(x, y(held));
        if (open) context.lineTo(right, y(held));
      }
      i = next;
    }
    context.stroke();
  }

  function drawEnds(context, span, flat, top, bottom, colours) {
    context.font = "10px system-ui, sans-serif";
    context.textBaseline = "middle";
    context.lineWidth = 3;
    context.strokeStyle = colours.panel;
    context.fillStyle = colours.muted;
    const whole = Number.isInteger(span.low) && Number.isInteger(span.high);
    const decimals = flat || whole ? 0 : Math.max(0, 2 - Math.floor(Math.log10(span.high - span.low)));
    const short = decimals <= 9 && Math.abs(span.high) + Math.abs(span.low) < 1e9;
    const text = (value) => (short && !flat ? value.toFixed(decimals).replace("-", "\u2212") : mauve.numberText(value));
    const places = flat ? [[span.low, bottom - 7]] : [[span.high, top + 6], [span.low, bottom + 7]];
    for (const [value, y] of places) {
      context.strokeText(text(value), 3, y);
      context.fillText(text(value), 3, y);
    }
  }

  mauve.startValues = function (timeline, described, columns) {
    const root = document.getElementById("values-view");
    if (!root) return;
    const values = (mauve.values = new Values(root, timeline, described, columns));
    mauve.listenToPlot(timeline, root, values.plot);
    mauve.addCross(timeline, values.plot);
    values.plot.addEventListener("pointermove", function (event) {
      const box = values.plot.getBoundingClientRect();
      const time = timeline.scale().time(event.clientX - box.left);
      const curve = values.at(event.clientY - box.top);
      timeline.pointAt(time);
      if (!curve || values.plot.classList.contains("dragged")) return mauve.hideTip();
      mauve.showTip([{ title: curve.name, facts: [["value", curve.text(time)]] }], event);
    });
    values.plot.addEventListener("pointerleave", function () {
      timeline.pointAt(null);
      mauve.hideTip();
    });
  };
})((window.mauve = window.mauve || {}));
