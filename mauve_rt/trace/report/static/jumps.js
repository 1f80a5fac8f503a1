// Buttons that go to the next reconfiguration, decision, overrun, worst wake-up, ...
(function (mauve) {
  "use strict";

  const AROUND_DECISION = 50e6; // ns

  // How much is shown around a place: some of its length, some periods of its row.
  function around(timeline, kind, [row, time, length]) {
    if (kind === "decision") return [time - AROUND_DECISION, time + AROUND_DECISION];
    const period = timeline.model.rows[row].period || 0;
    if (kind === "swap") {
      const half = Math.max(length * 4, 2e3);
      return [time - half, time + length + half];
    }
    const half = Math.max(length * 1.5, Math.min(period || Infinity, Math.max(length * 40, 2e6)), 5e3);
    return [time - half * 0.6, time + length + half];
  }

  // A page about a missed deadline opens there.
  mauve.openAtMiss = function (timeline) {
    const [place] = timeline.model.jumps.miss;
    if (!place) return;
    timeline.show(...around(timeline, "miss", place));
    timeline.choose(place[0]);
  };

  mauve.listenForJumps = function (timeline) {
    const bar = timeline.root.parentElement.querySelector(".toolbar");
    for (const box of bar.querySelectorAll("[data-jump]")) {
      const kind = box.dataset.jump;
      const places = timeline.model.jumps[kind];
      let at = -1;
      const [previous, next] = box.querySelectorAll("button");
      const small = box.querySelector("small");
      const go = function (step) {
        at = (at + step + places.length + (at < 0 && step < 0 ? 1 : 0)) % places.length;
        small.textContent = at + 1 + " of " + places.length.toLocaleString("en-US");
        timeline.glide(...around(timeline, kind, places[at]));
        timeline.choose(places[at][0]);
      };
      previous.addEventListener("click", () => go(-1));
      next.addEventListener("click", () => go(1));
      box.querySelector("b").addEventListener("click", () => go(1));
    }
    for (const button of bar.querySelectorAll("[data-zoom]")) {
      const act = {
        in: () => timeline.zoom(0.5),
        out: () => timeline.zoom(2),
        all: () => timeline.showAll(),
      }[button.dataset.zoom];
      button.addEventListener("click", act);
    }
  };
})((window.mauve = window.mauve || {}));
