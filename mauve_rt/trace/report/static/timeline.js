// The timeline: what is in view, and when it is drawn anew. input.js moves it, hover.js tells what is under the pointer.
(function (mauve) {
  "use strict";

  const SHORTEST = 40; // ns in view
  const MARGIN = 0.01;
  const GLIDE_MS = 260;

  mauve.Timeline = class {
    constructor(root, model) {
      this.root = root;
      this.model = model;
      this.plot = root.querySelector(".plot");
      this.canvas = this.plot.querySelector("canvas");
      this.overview = root.querySelector(".overview canvas");
      this.where = root.parentElement.querySelector(".where");
      this.rowHeight = mauve.rowHeight(model.rows.length);
      this.chosen = mauve.element("div", "chosen");
      this.chosen.hidden = true;
      this.plot.prepend(this.chosen);
      this.colours = mauve.readColours();
      this.whole = { begin: -MARGIN * model.duration, end: (1 + MARGIN) * model.duration };
      this.view = { ...this.whole };
      this.listeners = [];
      this.pointer = null; // time under the cursor
      this.pointed = []; // called when the cursor moves
      root.classList.toggle("dense", this.rowHeight < 40);
      root.style.setProperty("--row", this.rowHeight + "px");
      root.style.setProperty("--axis", mauve.AXIS_HEIGHT + "px");
      new ResizeObserver(() => this.resize()).observe(this.plot);
      this.resize();
    }

    get width() {
      return this.plot.clientWidth;
    }

    scale() {
      return new mauve.Scale(this.view, this.width);
    }

    resize() {
      const height = mauve.AXIS_HEIGHT + this.model.rows.length * this.rowHeight + mauve.rulesHeight(this.model);
      this.context = mauve.fitted(this.canvas, this.width, height);
      const box = this.overview.parentElement;
      this.overviewContext = mauve.fitted(this.overview, box.clientWidth, box.clientHeight);
      this.overviewPicture = null;
      this.draw(); // at once: a canvas of a new size is empty, and the frame that asked for it is to show something
    }

    recolour() {
      this.colours = mauve.readColours();
      this.overviewPicture = null;
      this.redraw();
    }

    // Show an interval of the trace's clock, as far as there is something.
    show(begin, end) {
      this.gliding = 0;
      this.place(begin, end);
    }

    place(begin, end) {
      const longest = this.whole.end - this.whole.begin;
      const span = Math.min(Math.max(end - begin, SHORTEST), longest);
      const middle = (begin + end) / 2;
      const from = Math.min(Math.max(middle - span / 2, this.whole.begin), this.whole.end - span);
      this.view = { begin: from, end: from + span };
      this.redraw();
    }

    showAll() {
      this.glide(this.whole.begin, this.whole.end);
    }

    zoom(factor, around = (this.view.begin + this.view.end) / 2) {
      const { begin, end } = this.view;
      this.show(around - (around - begin) * factor, around + (end - around) * factor);
    }

    pan(share) {
      const by = share * (this.view.end - this.view.begin);
      this.show(this.view.begin + by, this.view.end + by);
    }

    // Move to an interval so that the eye can follow; at once where less motion is asked for.
    glide(begin, end) {
      if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.show(begin, end);
      const from = { ...this.view };
      const ratio = Math.log((end - begin) / (from.end - from.begin));
      const started = performance.now();
      const run = (this.gliding = started);
      const step = (now) => {
        if (this.gliding !== run) return;
        const share = Math.min(1, Math.max(0, (now - started) / GLIDE_MS));
        const eased = share * share * (3 - 2 * share);
        const span = (from.end - from.begin) * Math.exp(ratio * eased);
        const middle = (from.begin + from.end) / 2;
        // the middle moves with the span, so that the place aimed at stays in view
        const closeness = Math.abs(ratio) < 1e-6 ? eased : (Math.exp(ratio * eased) - 1) / (Math.exp(ratio) - 1);
        const at = middle + ((begin + end) / 2 - middle) * closeness;
        if (share < 1) this.place(at - span / 2, at + span / 2);
        else this.place(begin, end);
        if (share < 1) requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }

    // Put the cursor of all plots at an instant; null hides it.
    pointAt(time) {
      this.pointer = time;
      for (const listener of this.pointed) listener();
    }

    // Mark a row; none when it is negative.
    choose(row) {
      this.chosen.hidden = row < 0;
      this.chosen.style.top = mauve.AXIS_HEIGHT + row * this.rowHeight + "px";
    }

    redraw() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => {
        this.waiting = false;
        this.draw();
      });
    }

    draw() {
      const { context, model, view, width, rowHeight, colours } = this;
      if (!width) return;
      mauve.drawTimeline(context, model, view, width, rowHeight, colours);
      this.drawBrush();
      const span = view.end - view.begin;
      this.where.textContent =
        mauve.timeText(span) + " in view, from " + mauve.instantText(view.begin + model.offset, span) +
        " to " + mauve.instantText(view.end + model.offset, span);
      for (const listener of this.listeners) listener();
    }

    drawBrush() {
      const context = this.overviewContext;
      const width = this.overview.clientWidth;
      const height = this.overview.clientHeight;
      if (!width) return;
      if (!this.overviewPicture) {
        mauve.drawOverview(context, this.model, this.whole, width, height, this.colours);
        this.overviewPicture = document.createElement("canvas");
        this.overviewPicture.width = this.overview.width;
        this.overviewPicture.height = this.overview.height;
        this.overviewPicture.getContext("2d").drawImage(this.overview, 0, 0);
      }
      context.clearRect(0, 0, width, height);
      context.drawImage(this.overviewPicture, 0, 0, width, height);
      const { left, right } = this.brush();
      context.fillStyle = this.colours.panel;
      context.globalAlpha = 0.66;
      context.fillRect(0, 0, left, height);
      context.fillRect(right, 0, width - right, height);
      context.globalAlpha = 1;
      context.strokeStyle = this.colours.accent;
      context.lineWidth = 1.5;
      context.strokeRect(left + 0.75, 0.75, Math.max(right - left - 1.5, 1), height - 1.5);
    }

    // Where the view is in the overview.
    brush() {
      const width = this.overview.clientWidth;
      const span = this.whole.end - this.whole.begin;
      const place = (time) => Math.min(Math.max(((time - this.whole.begin) / span) * width, 0), width);
      const left = place(this.view.begin);
      return { left: Math.min(left, width - 4), right: Math.max(place(this.view.end), left + 4) };
    }
  };

  // A canvas of so many CSS pixels, as fine as the screen.
  mauve.fitted = function (canvas, width, height) {
    const fineness = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(width * fineness));
    canvas.height = Math.max(1, Math.round(height * fineness));
    canvas.style.width = width + "px";
    canvas.style.height = height + "px";
    const context = canvas.getContext("2d");
    context.setTransform(fineness, 0, 0, fineness, 0, 0);
    return context;
  };
})((window.mauve = window.mauve || {}));
