// Wheel, mouse and keyboard on the timeline and its overview.
(function (mauve) {
  "use strict";

  const WHEEL = 0.0016; // per unit of a wheel event
  const EDGE = 6; // px around a brush's edge that take hold of it

  mauve.listenForInput = function (timeline) {
    mauve.listenToPlot(timeline, timeline.root, timeline.plot);
    listenToOverview(timeline);
  };

  // A plot on the timeline's axis, and what has the keyboard while one works on it.
  mauve.listenToPlot = function (timeline, root, plot) {
    let grip = null;
    root.addEventListener("keydown", (event) => pressed(timeline, event));
    plot.addEventListener(
      "wheel",
      function (event) {
        const sideways = Math.abs(event.deltaX) > Math.abs(event.deltaY);
        const all = timeline.view.end - timeline.view.begin >= timeline.whole.end - timeline.whole.begin;
        if (!sideways && event.deltaY > 0 && all) return; // nothing more to show: let the page scroll
        event.preventDefault();
        const pixels = event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : 1;
        if (sideways) return timeline.pan((event.deltaX * pixels) / timeline.width);
        const around = timeline.scale().time(event.clientX - plot.getBoundingClientRect().left);
        timeline.zoom(Math.exp(event.deltaY * pixels * WHEEL), around);
      },
      { passive: false }
    );
    plot.addEventListener("pointerdown", function (event) {
      if (event.button) return;
      grip = { x: event.clientX, begin: timeline.view.begin, end: timeline.view.end };
      plot.setPointerCapture(event.pointerId);
      root.focus({ preventScroll: true });
    });
    plot.addEventListener("pointermove", function (event) {
      if (!grip) return;
      plot.classList.add("dragged");
      const by = ((event.clientX - grip.x) / timeline.width) * (grip.end - grip.begin);
      timeline.show(grip.begin - by, grip.end - by);
    });
    for (const kind of ["pointerup", "pointercancel"]) {
      plot.addEventListener(kind, function () {
        grip = null;
        plot.classList.remove("dragged");
      });
    }
    plot.addEventListener("dblclick", () => timeline.showAll());
  };

  // Drag the brush, its edges, or a new one.
  function listenToOverview(timeline) {
    const box = timeline.overview.parentElement;
    const { begin, end } = timeline.whole;
    const time = (x) => begin + (x / timeline.overview.clientWidth) * (end - begin);
    let grip = null;
    const place = (event) => event.clientX - box.getBoundingClientRect().left;
    const part = function (x) {
      const { left, right } = timeline.brush();
      if (Math.abs(x - left) < EDGE) return "begin";
      if (Math.abs(x - right) < EDGE) return "end";
      return x > left && x < right && right - left < timeline.overview.clientWidth - 2 ? "middle" : "new";
    };
    box.addEventListener("pointerdown", function (event) {
      if (event.button) return;
      const x = place(event);
      grip = { x, part: part(x), ...timeline.view };
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointermove", function (event) {
      const x = place(event);
      if (!grip) {
        box.style.cursor = { begin: "ew-resize", end: "ew-resize", middle: "grab", new: "crosshair" }[part(x)];
        return;
      }
      const by = time(x) - time(grip.x);
      if (grip.part === "middle") timeline.show(grip.begin + by, grip.end + by);
      else if (grip.part === "begin") between(timeline, grip.begin + by, grip.end);
      else if (grip.part === "end") between(timeline, grip.begin, grip.end + by);
      else if (Math.abs(x - grip.x) > 2) between(timeline, time(grip.x), time(x));
    });
    for (const kind of ["pointerup", "pointercancel"]) {
      box.addEventListener(kind, function (event) {
        if (grip && kind === "pointerup" && grip.part === "new" && Math.abs(place(event) - grip.x) <= 2) {
          const half = (timeline.view.end - timeline.view.begin) / 2;
          timeline.glide(time(grip.x) - half, time(grip.x) + half);
        }
        grip = null;
      });
    }
    box.addEventListener("dblclick", () => timeline.showAll());
  }

  function between(timeline, one, other) {
    timeline.show(Math.min(one, other), Math.max(one, other));
  }

  const KEYS = {
    ArrowLeft: (timeline) => timeline.pan(-0.15),
    ArrowRight: (timeline) => timeline.pan(0.15),
    "+": (timeline) => timeline.zoom(0.7),
    "=": (timeline) => timeline.zoom(0.7),
    "-": (timeline) => timeline.zoom(1 / 0.7),
    0: (timeline) => timeline.showAll(),
    Home: (timeline) => timeline.showAll(),
  };

  function pressed(timeline, event) {
    const action = KEYS[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action(timeline);
  }
})((window.mauve = window.mauve || {}));
