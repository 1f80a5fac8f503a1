// Draws rows of the timeline, and the overview, on canvases. x is in CSS pixels, times on the trace's clock.
(function (mauve) {
  "use strict";

  mauve.AXIS_HEIGHT = 46;
  const TICK = 7; // of a release, above the slices
  const LEAST = 2.5; // px of height for whatever there is
  const LABEL_ROOM = 44;
  const GRID_ROOM = 7; // px between instants of a component's grid from which they are drawn
  const PER_PIXEL = 0.34; // entries from which shares of time are drawn instead

  mauve.rowHeight = (count) => (count > 24 ? 34 : count > 12 ? 40 : 48);

  class Scale {
    constructor(view, width) {
      this.begin = view.begin;
      this.perNs = width / (view.end - view.begin);
      this.width = width;
    }
    x(time) {
      return (time - this.begin) * this.perNs;
    }
    time(x) {
      return this.begin + x / this.perNs;
    }
  }
  mauve.Scale = Scale;

  function entriesWithin(track, begin, end) {
    const first = Math.max(track.last(begin), 0);
    return [first, track.last(end)];
  }

  function drawSlices(context, row, scale, top, bottom, colours) {
    const end = scale.time(scale.width);
    let entries = 0;
    const ranges = row.states.map(function (track) {
      const range = entriesWithin(track, scale.begin, end);
      entries += Math.max(0, range[1] - range[0] + 1);
      return range;
    });
    const many = entries > scale.width * PER_PIXEL;
    const merged = (track, [first, last]) => track.number.subarray(first, last + 1).some((number) => number > 1);
    if (many || row.states.some((track, i) => merged(track, ranges[i]))) drawShares(context, row, scale, top, bottom, colours);
    else row.states.forEach((track, i) => drawEntries(context, track, ranges[i], scale, top, bottom, colours, i));
  }

  function drawEntries(context, track, [first, last], scale, top, bottom, colours, index) {
    const room = bottom - top;
    const colour = colours.states[index % 8];
    for (let i = first; i <= last; i++) {
      const x = scale.x(track.begin[i]);
      const width = track.extent[i] * scale.perNs;
      if (x + width < 0 || x > scale.width) continue;
      context.fillStyle = colour;
      const from = Math.max(x, -10);
      const shown = Math.min(x + width, scale.width + 10) - from;
      if (width >= 1) {
        context.fillRect(from, top, shown, room);
        if (shown > LABEL_ROOM) nameSlice(context, track.name, from, shown, top, bottom, colours);
      } else {
        const height = Math.max(3, Math.cbrt(width) * room);
        context.fillRect(from, bottom - height, 1, height);
      }
    }
  }

  function nameSlice(context, name, x, width, top, bottom, colours) {
    const from = Math.max(x, 0) + 6;
    const room = x + width - from - 4;
    if (room < 16) return;
    context.save();
    context.beginPath();
    context.rect(from, top, room, bottom - top);
    context.clip();
    context.fillStyle = colours.panel;
    context.textBaseline = "middle";
    context.font = "600 11px system-ui, sans-serif";
    context.fillText(name, from, (top + bottom) / 2 + 0.5);
    context.restore();
  }

  // Of each pixel column: which share of its time each state took, stacked; the height is the cube root of the
  // share. What begins within a column is seen there, however short it is.
  function drawShares(context, row, scale, top, bottom, colours) {
    const room = bottom - top;
    const columns = Math.ceil(scale.width);
    const perColumn = 1 / scale.perNs;
    const states = row.states.map((track) => sharesOf(track, scale, columns));
    const ground = new Float64Array(columns).fill(bottom);
    states.forEach(function (shares, s) {
      context.fillStyle = colours.states[s % 8];
      for (let column = 0; column < columns; column++) {
        if (!shares.busy[column] && !shares.begun[column]) continue;
        let total = 0;
        let present = 0;
        for (const other of states) {
          total += other.busy[column];
          present += other.busy[column] > 0 || other.begun[column];
        }
        const height = Math.max(LEAST, Math.cbrt(Math.min(1, total / perColumn)) * room);
        const part = total > 0 ? (shares.busy[column] / total) * height : height / present;
        context.fillRect(column, ground[column] - part, 1, part);
        ground[column] -= part;
      }
    });
  }

  // Of each pixel column: busy time of a state in ns, and whether one began.
  function sharesOf(track, scale, columns) {
    const busy = new Float64Array(columns);
    const begun = new Uint8Array(columns);
    let index = track.last(scale.begin);
    let busyBefore = track.busyUntil(scale.begin, index);
    for (let column = 0; column < columns; column++) {
      const time = scale.time(column + 1);
      const next = track.last(time);
      const busyNow = track.busyUntil(time, next);
      busy[column] = Math.max(0, busyNow - busyBefore);
      begun[column] = next > index ? 1 : 0;
      busyBefore = busyNow;
      index = next;
    }
    return { busy, begun };
  }

  // The instants at which the component was due, as the deployment recorded them: also those that it skipped.
  function drawGrid(context, row, scale, top, bottom, colours) {
    context.fillStyle = colours.line;
    row.grids.forEach(function ([from, origin, period], index) {
      if (period * scale.perNs < GRID_ROOM) return;
      const until = index + 1 < row.grids.length ? row.grids[index + 1][0] : Infinity;
      const begin = Math.max(scale.begin, index ? from : -Infinity, origin);
      const end = Math.min(scale.time(scale.width), until);
      for (let k = Math.ceil((begin - origin) / period); origin + k * period <= end; k++) {
        if (!mauve.runsAt(row, origin + k * period)) continue;
        const x = Math.round(scale.x(origin + k * period)) - 0.5;
        for (let y = top - TICK; y < bottom; y += 4) context.fillRect(x, y, 1, 2);
      }
    });
  }

  function drawReleases(context, row, scale, top, bottom, colours) {
    const track = row.releases;
    const [first, last] = entriesWithin(track, scale.begin, scale.time(scale.width));
    if (last - first + 1 > scale.width * 0.25) {
      context.fillStyle = colours.muted;
      context.globalAlpha = 0.55;
      let before = track.last(scale.begin);
      let until = -1; // x up to which a merged entry reaches
      for (let column = 0; column < scale.width; column++) {
        const index = track.last(scale.time(column + 1));
        if (index > before && track.number[index] > 1) until = scale.x(track.begin[index] + track.extent[index]);
        if (index > before || column < until) context.fillRect(column, top - 3, 1, 3);
        before = index;
      }
      context.globalAlpha = 1;
      return;
    }
    drawGrid(context, row, scale, top, bottom, colours);
    context.fillStyle = colours.muted;
    for (let i = first; i <= last; i++) {
      const x = scale.x(track.begin[i]);
      const merged = track.number[i] > 1;
      if (merged) {
        context.globalAlpha = 0.55;
        context.fillRect(x, top - 3, Math.max(1, track.extent[i] * scale.perNs), 3);
        context.globalAlpha = 1;
        continue;
      }
      const late = track.wakeup[i] * scale.perNs;
      if (x + late < -2) continue;
      if (late > 1.5) { // from where it was due to where it came
        context.globalAlpha = 0.25;
        context.fillRect(x, top + 2, late, bottom - top - 2);
        context.globalAlpha = 1;
        context.fillRect(x, bottom - 1.5, late, 1.5);
      }
      context.fillRect(Math.round(x) - 0.5, top - TICK, 1, late > 1.5 ? bottom - top + TICK : TICK);
    }
  }

  const SHAPES = {
    mark(context, x, y) {
      context.beginPath();
      context.arc(x, y, 3.2, 0, 2 * Math.PI);
      context.fill();
    },
    start(context, x, y) {
      polygon(context, [[x - 3, y - 4], [x + 4, y], [x - 3, y + 4]]);
    },
    stop(context, x, y) {
      context.fillRect(x - 3.5, y - 3.5, 7, 7);
    },
    overrun(context, x, y) {
      polygon(context, [[x - 4.5, y - 4], [x + 4.5, y - 4], [x, y + 4.5]]);
    },
    log(context, x, y) {
      context.fillRect(x - 3.5, y - 2.5, 7, 1.5);
      context.fillRect(x - 3.5, y + 1, 5, 1.5);
    },
    warning(context, x, y) {
      context.fillRect(x - 3.5, y - 2.5, 7, 2);
      context.fillRect(x - 3.5, y + 1, 7, 2);
    },
    violation(context, x, y) {
      polygon(context, [[x - 4.5, y + 4], [x + 4.5, y + 4], [x, y - 4.5]]);
    },
    fault(context, x, y) {
      polygon(context, [[x, y - 6], [x + 6, y], [x, y + 6], [x - 6, y]]);
    },
  };
  const ORDER = ["log", "mark", "warning", "start", "stop", "violation", "overrun", "fault"];
  const SERIOUS = ["violation", "overrun", "fault"];

  function polygon(context, points) {
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.fill();
  }

  mauve.markerColour = (kind, colours) =>
    SERIOUS.includes(kind)
      ? colours.bad
      : { mark: colours.accent, start: colours.good, stop: colours.ink, log: colours.muted, warning: colours.attention }[kind];

  function drawMarkers(context, row, scale, top, bottom, colours) {
    const sorted = [...row.markers].sort((a, b) => ORDER.indexOf(a.kind) - ORDER.indexOf(b.kind));
    for (const markers of sorted) {
      const colour = mauve.markerColour(markers.kind, colours);
      const serious = SERIOUS.includes(markers.kind);
      let i = mauve.lastAtOrBefore(markers.time, scale.time(-8)) + 1;
      while (i < markers.time.length) {
        const x = scale.x(markers.time[i]);
        if (x > scale.width + 8) break;
        context.fillStyle = colour;
        if (serious) {
          const late = markers.value[i] * scale.perNs; // 0 of a fault
          if (late > 2) {
            context.globalAlpha = 0.22;
            context.fillRect(x - late, top, late, bottom - top);
            context.globalAlpha = 1;
          }
          context.fillRect(x - 0.75, top - TICK, 1.5, bottom - top + TICK);
        }
        SHAPES[markers.kind](context, x, top - TICK + (serious ? 2 : 3));
        // the next one that is not on the same pixels
        i = Math.max(i + 1, mauve.lastAtOrBefore(markers.time, scale.time(x + 3)) + 1);
      }
    }
  }

  mauve.drawAxis = function (context, model, scale, height, colours) {
    const view = { begin: scale.begin + model.offset, end: scale.time(scale.width) + model.offset };
    const axis = mauve.axisTicks(view.begin, view.end, Math.max(2, Math.floor(scale.width / 105)));
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "alphabetic";
    for (const tick of axis.ticks) {
      const x = Math.round(scale.x(tick.time - model.offset)) + 0.5;
      context.fillStyle = colours.line;
      context.fillRect(x - 0.5, 20, 1, height - 20);
      context.fillStyle = colours.muted;
      const width = context.measureText(tick.text).width;
      const free = x - width / 2 > (axis.base === null ? -1 : 78) && x + width / 2 < scale.width + 1;
      if (free) context.fillText(tick.text, x - width / 2, 14);
    }
    if (model.bucket) {
      context.fillStyle = colours.accent;
      for (const [begin, end] of model.kept) {
        const from = Math.max(scale.x(begin), 0);
        const to = Math.min(scale.x(end), scale.width);
        if (to >= 0 && from <= scale.width) context.fillRect(from, 19, Math.max(to - from, 1), 2);
      }
    }
    if (axis.base !== null) {
      context.fillStyle = colours.ink;
      context.font = "600 11px system-ui, sans-serif";
      context.fillText(mauve.baseText(axis.base, view.end - view.begin), 2, 14);
    }
  };

  // Adopt and take: how long they took is recorded, and an instant just after them.
  function drawPhases(context, swap, scale, top, rowHeight, colours) {
    let at = Math.max(swap.parked, swap.changed - swap.take - swap.adopt);
    context.font = "600 11px system-ui, sans-serif";
    context.textBaseline = "middle";
    for (const phase of ["adopt", "take"]) {
      const x = scale.x(at);
      const width = Math.max(1.5, swap[phase] * scale.perNs);
      context.fillStyle = colours.swap;
      context.fillRect(x, top + 15, width, rowHeight - 22);
      if (width > LABEL_ROOM) {
        context.fillStyle = colours.panel;
        context.fillText(phase, x + 6, top + rowHeight / 2 + 4);
      }
      at += swap[phase];
    }
    context.textBaseline = "alphabetic";
    context.font = "600 11px system-ui, sans-serif";
    context.fillStyle = colours.swap;
  }

  function drawSwaps(context, model, scale, height, rowHeight, colours) {
    let free = -Infinity;
    const labels = [];
    context.font = "600 11px system-ui, sans-serif";
    context.textBaseline = "alphabetic";
    for (const swap of model.swaps) {
      const x = scale.x(swap.parked);
      const width = Math.max(1.5, (swap.armed - swap.parked) * scale.perNs);
      if (x + width < -2 || x > scale.width + 2) continue;
      const top = mauve.AXIS_HEIGHT + swap.row * rowHeight;
      context.fillStyle = colours.swap;
      context.globalAlpha = width > 3 ? 0.13 : 0.4;
      context.fillRect(x, 22, width, height - 22);
      context.globalAlpha = width > 3 ? 0.4 : 1;
      context.fillRect(x, top, width, rowHeight);
      context.globalAlpha = 1;
      if (width > 24) drawPhases(context, swap, scale, top, rowHeight, colours);
      const from = Math.max(x, 0);
      polygon(context, [[from, 22], [from + 8, 26], [from, 30]]);
      if (from > free) {
        const text = swap.what + (swap.committed ? "" : " (refused)") + ", " + mauve.timeText(swap.armed - swap.parked);
        const room = context.measureText(text).width;
        const left = from + 12 + room > scale.width ? from - room - 6 : from + 12;
        if (left > free) {
          labels.push([text, left, room]);
          free = left + room + 14;
        }
      }
    }
    for (const [text, left, room] of labels) {
      context.fillStyle = colours.panel;
      context.globalAlpha = 0.85;
      context.fillRect(left - 2, 23, room + 4, 13);
      context.globalAlpha = 1;
      context.fillStyle = colours.swap;
      context.fillText(text, left, 33);
    }
  }

  // One whole picture of what is in view.
  mauve.drawTimeline = function (context, model, view, width, rowHeight, colours) {
    const scale = new Scale(view, width);
    const lanes = mauve.AXIS_HEIGHT + model.rows.length * rowHeight;
    const height = lanes + mauve.rulesHeight(model);
    context.clearRect(0, 0, width, height);
    mauve.drawAxis(context, model, scale, height, colours);
    model.rows.forEach(function (row, index) {
      const top = mauve.AXIS_HEIGHT + index * rowHeight;
      context.fillStyle = colours.line;
      context.fillRect(0, top + rowHeight - 1, width, 1);
      drawSlices(context, row, scale, top + 14, top + rowHeight - 5, colours);
      drawReleases(context, row, scale, top + 14, top + rowHeight - 5, colours);
    });
    drawSwaps(context, model, scale, height, rowHeight, colours);
    model.rows.forEach(function (row, index) {
      const top = mauve.AXIS_HEIGHT + index * rowHeight;
      drawMarkers(context, row, scale, top + 14, top + rowHeight - 5, colours);
    });
    mauve.drawDecisions(context, model, scale, lanes, colours);
  };

  // The whole trace, small: a strip per row, then what went wrong, then the reconfigurations.
  mauve.drawOverview = function (context, model, whole, width, height, colours) {
    const scale = new Scale(whole, width);
    context.clearRect(0, 0, width, height);
    const strip = (height - 6) / model.rows.length;
    model.rows.forEach(function (row, index) {
      const top = 3 + index * strip;
      drawShares(context, row, scale, top + strip * 0.15, top + strip, colours);
    });
    for (const swap of model.swaps) {
      context.fillStyle = colours.swap;
      context.fillRect(scale.x(swap.parked) - 0.75, 0, Math.max(1.5, (swap.armed - swap.parked) * scale.perNs), height);
    }
    model.rows.forEach(function (row, index) {
      for (const markers of row.markers) {
        if (!SERIOUS.includes(markers.kind)) continue;
        context.fillStyle = colours.bad;
        for (let i = 0; i < markers.time.length; ) {
          const x = scale.x(markers.time[i]);
          context.fillRect(x - 1, 2 + index * strip, 2, Math.max(strip, 4));
          i = Math.max(i + 1, mauve.lastAtOrBefore(markers.time, scale.time(x + 1)) + 1);
        }
      }
    });
    if (model.bucket) {
      context.fillStyle = colours.accent;
      for (const [begin, end] of model.kept) {
        context.fillRect(scale.x(begin), height - 2, Math.max(1, (end - begin) * scale.perNs), 2);
      }
    }
  };
})((window.mauve = window.mauve || {}));
