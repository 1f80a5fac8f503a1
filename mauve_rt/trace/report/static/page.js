// Brings the page to life: theme, choosers, tips, histograms, the timeline.
(function (mauve) {
  "use strict";

  const root = document.documentElement;

  function listenForTheme() {
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const changed = () => mauve.timeline && mauve.timeline.recolour();
    document.getElementById("theme").addEventListener("click", function () {
      const now = root.dataset.theme || (dark.matches ? "dark" : "light");
      root.dataset.theme = now === "dark" ? "light" : "dark";
      changed();
    });
    dark.addEventListener("change", changed);
    matchMedia("print").addEventListener("change", changed);
  }

  // <select data-chooser="x"> shows the element [data-chosen="x"] of its value.
  function listenForChoices() {
    for (const select of document.querySelectorAll("[data-chooser]")) {
      select.addEventListener("change", function () {
        for (const one of document.querySelectorAll('[data-chosen="' + select.dataset.chooser + '"]')) {
          one.hidden = one.dataset.value !== select.value;
        }
      });
    }
  }

  function listenForTips() {
    document.addEventListener("pointermove", function (event) {
      if (!(event.target instanceof Element) || event.target.closest(".plot")) return;
      const histogram = event.target.closest("[data-histogram]");
      if (histogram) return hoverHistogram(histogram, event);
      const told = event.target.closest("[data-tip]");
      if (!told) return mauve.hideTip();
      const [title, ...notes] = told.dataset.tip.split("\n");
      mauve.showTip([{ title, notes }], event);
    });
    document.addEventListener("pointerleave", mauve.hideTip);
  }

  function hoverHistogram(drawing, event) {
    const data = (drawing.histogramData = drawing.histogramData || JSON.parse(drawing.dataset.histogram));
    const [left, , width] = data.area;
    const box = drawing.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * drawing.viewBox.baseVal.width;
    const bins = data.edges.length - 1;
    const bin = Math.min(bins - 1, Math.max(0, Math.floor(((x - left) / width) * bins)));
    const cursor = drawing.querySelector(".cursor");
    cursor.setAttribute("x", left + (bin * width) / bins);
    cursor.setAttribute("width", width / bins);
    cursor.setAttribute("y", data.area[1]);
    const facts = data.counts.map(function (counts, series) {
      const total = counts.reduce((sum, one) => sum + one, 0);
      const share = total ? mauve.shareText(counts[bin] / total) : "none";
      return [data.names[series] || "count", counts[bin].toLocaleString("en-US") + " (" + share + ")"];
    });
    const title = mauve.timeText(data.edges[bin]) + " to " + mauve.timeText(data.edges[bin + 1]);
    mauve.showTip([{ title, facts }], event);
  }

  async function startTimeline() {
    const place = document.getElementById("timeline-view");
    if (!place) return;
    const described = JSON.parse(document.getElementById("timeline-described").textContent);
    const columns = await mauve.unpackColumns(described.columns, document.getElementById("timeline-columns").textContent);
    mauve.timeline = new mauve.Timeline(place, mauve.buildModel(described, columns));
    mauve.listenForInput(mauve.timeline);
    mauve.listenForHover(mauve.timeline);
    mauve.startValues(mauve.timeline, described.values, columns);
    mauve.listenForJumps(mauve.timeline);
    mauve.openAtMiss(mauve.timeline);
  }

  listenForTheme();
  listenForChoices();
  listenForTips();
  startTimeline().then(
    () => (root.dataset.ready = "yes"),
    function (error) {
      root.dataset.ready = "failed";
      console.error("the timeline cannot be shown:", error);
      const told = mauve.element("p", "nothing", "The timeline cannot be shown by this browser: " + error.message);
      document.getElementById("timeline-view").replaceWith(told);
    }
  );
})((window.mauve = window.mauve || {}));
