// What is under the pointer, in words.
(function (mauve) {
  "use strict";

  const NEAR = 4; // px
  const MERGED = "Only what is around reconfigurations, overruns, faults and the worst latencies is kept in full.";
  const tip = () => document.getElementById("tip");

  // Show lines near the pointer: {title, colour, facts: [[word, value]], notes: [text]} each.
  mauve.showTip = function (blocks, event) {
    const box = tip();
    box.replaceChildren(
      ...blocks.map(function (block) {
        const made = mauve.element("div", "block");
        if (block.title) {
          const title = mauve.element("p", "title");
          if (block.colour) {
            const dot = mauve.element("i");
            dot.style.background = block.colour;
            title.append(dot);
          }
          title.append(mauve.element("span", "", block.title));
          made.append(title);
        }
        for (const [word, value] of block.facts || []) {
          const line = mauve.element("p", "fact");
          line.append(mauve.element("span", "", word), mauve.element("b", "", value));
          made.append(line);
        }
        for (const note of block.notes || []) made.append(mauve.element("p", "note", note));
        return made;
      })
    );
    box.hidden = false;
    const { width, height } = box.getBoundingClientRect();
    const right = event.clientX + 16 + width > window.innerWidth - 8;
    const below = event.clientY + 16 + height > window.innerHeight - 8;
    box.style.left = Math.max(8, right ? event.clientX - 14 - width : event.clientX + 16) + "px";
    box.style.top = Math.max(8, below ? event.clientY - 14 - height : event.clientY + 16) + "px";
  };

  mauve.hideTip = () => (tip().hidden = true);

  function executions(row, timeline, time, pixel) {
    const blocks = [];
    row.states.forEach(function (track, index) {
      const colour = timeline.colours.states[index % 8];
      const many = track.begunUntil(time + pixel) - track.begunUntil(time - pixel);
      const at = track.last(time + NEAR * pixel);
      if (at < 0) return;
      if (many > 2 && track.number[at] === 1) {
        const busy = track.busyUntil(time + pixel) - track.busyUntil(time - pixel);
        const facts = [["share of the time", mauve.shareText(busy / (2 * pixel))]];
        blocks.push({ title: track.name, colour, facts: [["executions here", mauve.countText(many, "execution")], ...facts] });
        return;
      }
      if (track.begin[at] + track.extent[at] < time - NEAR * pixel) return;
      blocks.push({ title: track.name, colour, ...described(track, at, timeline) });
    });
    return blocks;
  }

  function described(track, at, timeline) {
    const begin = mauve.instantText(track.begin[at] + timeline.model.offset, track.extent[at] || 1000);
    if (track.number[at] === 1) return { facts: [["execution time", mauve.timeText(track.extent[at])], ["begin", begin]] };
    const share = track.extent[at] ? 1 - track.idle[at] / track.extent[at] : 0;
    return {
      merged: true,
      facts: [
        ["merged", mauve.countText(track.number[at], "execution")],
        ["within", mauve.timeText(track.extent[at])],
        ["share of the time", mauve.shareText(share)],
        ["begin", begin],
      ],
    };
  }

  function release(row, timeline, time, pixel) {
    const track = row.releases;
    const at = track.last(time + NEAR * pixel);
    if (at < 0) return [];
    const cycle = Math.max(track.extent[at], track.response[at], track.wakeup[at], NEAR * pixel);
    if (track.begin[at] + cycle < time - NEAR * pixel) return [];
    const from = track.last(time - pixel);
    const here = track.numberBefore[track.last(time + pixel) + 1] - track.numberBefore[from + 1];
    if (track.number[at] > 1 || here > 2) {
      let wakeup = 0;
      let response = 0;
      const first = Math.max(0, track.number[at] > 1 ? at : from + 1);
      for (let i = first; i <= at && i < first + 20000; i++) {
        wakeup = Math.max(wakeup, track.wakeup[i]);
        response = Math.max(response, track.response[i]);
      }
      const count = track.number[at] > 1 ? track.number[at] : here;
      return [{
        title: mauve.countText(count, "release"),
        facts: [["worst wake-up latency", mauve.timeText(wakeup)], ["worst response time", mauve.timeText(response)]],
      }];
    }
    const facts = [
      ["nominal", mauve.instantText(track.begin[at] + timeline.model.offset, 1000)],
      ["wake-up latency", mauve.timeText(track.wakeup[at])],
      ["response time", track.response[at] < 0 ? "not told" : mauve.timeText(track.response[at])],
    ];
    return [{ title: "Release", facts }];
  }

  function markers(row, timeline, time, pixel) {
    const blocks = [];
    for (const one of row.markers) {
      const first = mauve.lastAtOrBefore(one.time, time - 5 * pixel) + 1;
      const last = mauve.lastAtOrBefore(one.time, time + 5 * pixel);
      if (first > last) continue;
      let count = 0;
      let worst = first;
      let skipped = 0;
      for (let i = first; i <= last && i < first + 20000; i++) {
        count += one.number[i];
        skipped += one.skipped[i];
        if (one.value[i] > one.value[worst]) worst = i;
      }
      const name = timeline.model.names[one.name[worst]] || "";
      const title = (count > 1 ? mauve.countText(count, one.kind) : one.kind) + (name ? ": " + name : "");
      const facts = [["at", mauve.instantText(one.time[worst] + timeline.model.offset, 1000)]];
      if (one.kind === "overrun") {
        facts.push([count > 1 ? "late by at most" : "late by", mauve.timeText(one.value[worst])]);
        facts.push(["instants skipped", String(skipped)]);
      }
      if (one.kind === "violation") facts.push(["above its bound by at most", mauve.timeText(one.value[worst])]);
      blocks.push({ title, colour: mauve.markerColour(one.kind, timeline.colours), facts });
    }
    return blocks;
  }

  function swaps(timeline, time, pixel) {
    return timeline.model.swaps
      .filter((swap) => swap.parked - 4 * pixel <= time && time <= swap.armed + 4 * pixel)
      .slice(0, 3)
      .map(function (swap) {
        const facts = [
          ["component", timeline.model.rows[swap.row].name],
          ["blackout", mauve.timeText(swap.armed - swap.parked)],
          ["adopt, take", mauve.timeText(swap.adopt) + ", " + mauve.timeText(swap.take)],
          ["missed releases", swap.missed === null ? "no period" : String(swap.missed)],
        ];
        if (swap.by) facts.push(["asked by", swap.by]);
        const notes = [swap.cause, swap.committed ? "" : "Refused by adopt: all went on as before."].filter(Boolean);
        return { title: "Reconfigured: " + swap.what, colour: timeline.colours.swap, facts, notes };
      });
  }

  // Everything at a place of the plot.
  mauve.tipAt = function (timeline, x, y) {
    const scale = timeline.scale();
    const time = scale.time(x);
    const pixel = 1 / scale.perNs;
    const index = Math.floor((y - mauve.AXIS_HEIGHT) / timeline.rowHeight);
    const row = timeline.model.rows[index];
    const found = swaps(timeline, time, pixel);
    if (row) {
      found.push(...markers(row, timeline, time, pixel));
      const executed = executions(row, timeline, time, pixel);
      found.push(...executed, ...release(row, timeline, time, pixel));
      if (executed.some((block) => block.merged)) found.push({ notes: [MERGED] });
      if (found.length) found.unshift({ title: row.name });
    }
    if (index >= timeline.model.rows.length) found.push(...mauve.decisionsAt(timeline, time, pixel));
    return { index: row ? index : -1, blocks: found, time };
  };

  // The timeline's cursor, in one plot.
  mauve.addCross = function (timeline, plot) {
    const cross = mauve.element("div", "cross");
    const clock = mauve.element("span");
    cross.append(clock);
    plot.append(cross);
    const place = function () {
      const { pointer, view, model } = timeline;
      cross.hidden = pointer === null || pointer < view.begin || pointer > view.end;
      if (cross.hidden) return;
      const x = timeline.scale().x(pointer);
      cross.style.left = x + "px";
      clock.textContent = mauve.instantText(pointer + model.offset, (view.end - view.begin) / 100);
      clock.classList.toggle("left", x > timeline.width - 110);
    };
    place();
    timeline.pointed.push(place);
    timeline.listeners.push(place);
  };

  mauve.listenForHover = function (timeline) {
    const plot = timeline.plot;
    mauve.addCross(timeline, plot);
    plot.addEventListener("pointermove", function (event) {
      const box = plot.getBoundingClientRect();
      const x = event.clientX - box.left;
      const { index, blocks, time } = mauve.tipAt(timeline, x, event.clientY - box.top);
      timeline.pointAt(time);
      timeline.choose(index);
      if (blocks.length && !plot.classList.contains("dragged")) mauve.showTip(blocks, event);
      else mauve.hideTip();
    });
    plot.addEventListener("pointerleave", function () {
      timeline.pointAt(null);
      mauve.hideTip();
      timeline.choose(-1);
    });
  };
})((window.mauve = window.mauve || {}));
