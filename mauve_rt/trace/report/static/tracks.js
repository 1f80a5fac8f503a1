// Sorted entries on a row, with sums over them: any interval's share of busy time is two binary searches away.
(function (mauve) {
  "use strict";

  // Greatest index whose value is <= limit; -1 when there is none.
  mauve.lastAtOrBefore = function (sorted, limit) {
    let low = 0;
    let high = sorted.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (sorted[middle] <= limit) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  };

  function sumsBefore(length, of) {
    const sums = new Float64Array(length + 1);
    for (let i = 0; i < length; i++) sums[i + 1] = sums[i] + of(i);
    return sums;
  }

  // Executions of one state. An entry of number > 1 stands for several, idle in between.
  mauve.StateTrack = class {
    constructor(name, begin, extent, idle, number) {
      this.name = name;
      this.begin = begin;
      this.extent = extent;
      this.idle = idle;
      this.number = number;
      this.busyBefore = sumsBefore(begin.length, (i) => extent[i] - idle[i]);
      this.numberBefore = sumsBefore(begin.length, (i) => number[i]);
    }

    last(time) {
      return mauve.lastAtOrBefore(this.begin, time);
    }

    // Busy time from the begin of the trace; within a merged entry as if it were spread evenly.
    busyUntil(time, index = this.last(time)) {
      if (index < 0) return 0;
      const extent = this.extent[index];
      const part = extent > 0 ? Math.min(1, (time - this.begin[index]) / extent) : 1;
      return this.busyBefore[index] + (extent - this.idle[index]) * part;
    }

    // Executions begun so far, again spread evenly within a merged entry.
    begunUntil(time, index = this.last(time)) {
      if (index < 0) return 0;
      const number = this.number[index];
      if (number === 1) return this.numberBefore[index + 1];
      const extent = this.extent[index];
      const part = extent > 0 ? Math.min(1, (time - this.begin[index]) / extent) : 1;
      return this.numberBefore[index] + Math.max(1, number * part);
    }
  };

  mauve.ReleaseTrack = class {
    constructor(begin, extent, number, wakeup, response) {
      Object.assign(this, { begin, extent, number, wakeup, response });
      this.numberBefore = sumsBefore(begin.length, (i) => number[i]);
    }

    last(time) {
      return mauve.lastAtOrBefore(this.begin, time);
    }
  };

  // When a row began and ceased to run: [time, running] in order.
  function turnsOf(markers) {
    const turns = [];
    for (const { kind, time } of markers) {
      if (kind === "start" || kind === "stop" || kind === "fault") for (const at of time) turns.push([at, kind === "start"]);
    }
    return turns.sort((a, b) => a[0] - b[0]);
  }

  mauve.runsAt = function (row, time) {
    let running = !row.turns.length || !row.turns[0][1];
    for (const [at, now] of row.turns) {
      if (at > time) break;
      running = now;
    }
    return running;
  };

  // Builds the model of the page's timeline: rows with tracks, on a clock that begins with the trace.
  mauve.buildModel = function (described, columns) {
    const rows = described.rows.map(function (row) {
      const r = row.releases;
      const markers = row.markers.map((m) => ({
        kind: m.kind,
        time: columns[m.time],
        number: columns[m.number],
        name: columns[m.name],
        value: columns[m.value],
        skipped: columns[m.skipped],
      }));
      return {
        name: row.name,
        period: row.period,
        grids: row.grids,
        lost: row.lost,
        states: row.states.map(
          (s) => new mauve.StateTrack(s.name, columns[s.begin], columns[s.extent], columns[s.idle], columns[s.number])
        ),
        releases: new mauve.ReleaseTrack(
          columns[r.begin], columns[r.extent], columns[r.number], columns[r.wakeup], columns[r.response]
        ),
        markers,
        turns: turnsOf(markers),
      };
    });
    return {
      rows,
      names: described.names,
      swaps: described.swaps,
      decisions: described.decisions,
      jumps: described.jumps,
      kept: described.kept,
      bucket: described.bucket,
      offset: described.begin, // of the page's clock at the begin of the trace
      duration: Math.max(described.duration, 1),
    };
  };
})((window.mauve = window.mauve || {}));
