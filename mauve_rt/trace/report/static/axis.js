// Where the ticks of a time axis are and what they say, from hours down to nanoseconds.
(function (mauve) {
  "use strict";

  const NARROW = "\u202f";
  const LONG_STEPS = [60, 120, 300, 600, 1200, 3600, 7200, 14400, 43200, 86400].map((s) => s * 1e9);

  function stepAtLeast(least) {
    if (least > 30e9) return LONG_STEPS.find((step) => step >= least) || LONG_STEPS[LONG_STEPS.length - 1];
    const power = 10 ** Math.floor(Math.log10(Math.max(least, 1)));
    const factor = [1, 2, 5, 10].find((one) => one * power >= least * 0.999);
    return factor * power === 50e9 ? 60e9 : factor * power;
  }

  function clockText(ns) {
    const seconds = Math.round(ns / 1e9);
    const sign = seconds < 0 ? "\u2212" : "";
    const size = Math.abs(seconds);
    const two = (value) => String(value).padStart(2, "0");
    const minutes = Math.floor(size / 60);
    const hours = Math.floor(minutes / 60);
    return sign + (hours ? hours + ":" + two(minutes % 60) : minutes) + ":" + two(size % 60);
  }

  // Ticks of the interval [begin, end] of the page's clock: {step, base, ticks: [{time, text}]}. When the base is
  // not null, the texts count from it.
  mauve.axisTicks = function (begin, end, most) {
    const span = end - begin;
    const step = stepAtLeast(span / Math.max(most, 1));
    const times = [];
    for (let k = Math.ceil(begin / step); k * step <= end && times.length < 200; k++) times.push(k * step);
    if (step >= 60e9) return { step, base: null, ticks: times.map((time) => ({ time, text: clockText(time) + NARROW + "min" })) };
    const [unit, factor] = step >= 1e8 ? ["s", 1e9] : step >= 1e5 ? ["ms", 1e6] : step >= 1e2 ? ["\u00b5s", 1e3] : ["ns", 1];
    const decimals = Math.max(0, Math.round(Math.log10(factor)) - Math.floor(Math.log10(step) + 1e-9));
    const format = (value) => (value / factor).toFixed(decimals).replace("-", "\u2212") + NARROW + unit;
    if (factor === 1e9) return { step, base: null, ticks: times.map((time) => ({ time, text: format(time) })) };
    const coarse = 10 ** Math.floor(Math.log10(span));
    const base = Math.floor(begin / coarse) * coarse;
    return { step, base, ticks: times.map((time) => ({ time, text: "+" + format(time - base) })) };
  };

  // The base of an axis as exact as it is: a multiple of a power of ten.
  mauve.baseText = function (base, span) {
    const decimals = Math.min(9, Math.max(0, 9 - Math.floor(Math.log10(span))));
    return (base / 1e9).toFixed(decimals).replace("-", "\u2212") + NARROW + "s";
  };
})((window.mauve = window.mauve || {}));
