// Decisions of rules: flags on a thin row below those of the components, and what they say under the pointer.
(function (mauve) {
  "use strict";

  const HEIGHT = 24; // of the row, px
  const POLE = 16;
  const NEAR = 6; // px

  // Height of the row; none without decisions.
  mauve.rulesHeight = (model) => (model.decisions.length ? HEIGHT : 0);

  mauve.decisionColour = (level, colours) =>
    ({ acts: colours.swap, fails: colours.bad, waits: colours.attention, sees: colours.muted })[level];

  function firstFrom(decisions, time) {
    let low = 0;
    let high = decisions.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (decisions[middle].time < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  mauve.drawDecisions = function (context, model, scale, top, colours) {
    if (!model.decisions.length) return;
    const bottom = top + HEIGHT - 3;
    context.fillStyle = colours.line;
    context.fillRect(0, top + HEIGHT - 1, scale.width, 1);
    for (let i = firstFrom(model.decisions, scale.time(-10)); i < model.decisions.length; i++) {
      const { time, level } = model.decisions[i];
      const x = scale.x(time);
      if (x > scale.width + 2) break;
      context.fillStyle = mauve.decisionColour(level, colours);
      context.fillRect(x - 0.5, bottom - POLE, 1, POLE);
      context.beginPath();
      context.moveTo(x, bottom - POLE);
      context.lineTo(x + 9, bottom - POLE + 3.5);
      context.lineTo(x, bottom - POLE + 7);
      context.fill();
    }
  };

  // The flags at an instant, in words.
  mauve.decisionsAt = function (timeline, time, pixel) {
    const { decisions, offset } = timeline.model;
    const blocks = [];
    for (let i = firstFrom(decisions, time - (NEAR + 3) * pixel); i < decisions.length && blocks.length < 6; i++) {
      const one = decisions[i];
      if (one.time > time + NEAR * pixel) break;
      const facts = [["at", mauve.instantText(one.time + offset, 1000)]];
      if (one.took !== null) facts.push(["took", mauve.timeText(one.took)]);
      if (one.bound !== null) facts.push(["at most", mauve.timeText(one.bound)]);
      const title = [one.rule, one.decision, one.reason].filter(Boolean).join(": ");
      blocks.push({ title, colour: mauve.decisionColour(one.level, timeline.colours), facts });
    }
    return blocks;
  };
})((window.mauve = window.mauve || {}));
