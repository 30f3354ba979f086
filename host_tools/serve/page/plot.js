// SPDX-License-Identifier: GPL-3.0-or-later
// Line plots on a canvas. A series is {x: [..], y: [..], colour: "--position", label, dash, dots}; null or NaN in y is a
// gap; with dots each point is one, for more of them than lines can be drawn between.
//
// A drag enlarges a part (a double click shows all again), a click on a legend hides its series, the pointer reads
// values out. So do keys: left and right move the reading, + and - change the part around it, 0 shows all, 1 to 9 hide a
// series. An enlarged plot of what is live keeps its picture until all is shown again.
"use strict";

// Steps of 1, 2 or 5 times a power of ten, about `most` of them.
function ticksOf(low, high, most) {
  const raw = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].reduce((best, one) => // the nearest by ratio
    Math.abs(Math.log(one * power / raw)) < Math.abs(Math.log(best * power / raw)) ? one : best);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
    ticks.push(k * step);
  }
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return ticks.map((value) => ({ value, text: value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1") }));
}

function rangeOf(series, key, least) {
  let low = Infinity, high = -Infinity;
  for (const s of series) {
    for (const value of s[key]) {
      if (value !== null && value < low) { low = value; }
      if (value !== null && value > high) { high = value; }
    }
  }
  if (low > high) { return [0, 1]; }
  const middle = (low + high) / 2, half = Math.max((high - low) / 2 * (key === "y" ? 1.06 : 1), least / 2);
  return [middle - half, middle + half];
}

// y against time, as it looks in so many columns: with more samples than columns the first, the lowest, the highest and
// the last of each column, which draw the same as all of them. `x` is the time before `end`, back to `span`.
function envelope(t, y, end, span, columns) {
  const made = { x: [], y: [] };
  const put = (i) => {
    made.x.push(t[i] - end);
    made.y.push(Number.isNaN(y[i]) ? null : y[i]);
  };
  if (t.length <= 4 * columns) {
    for (let i = 0; i < t.length; i++) { put(i); }
    return made;
  }
  let first = -1, low = 0, high = 0, last = 0, column = 0;
  const close = () => {
    if (first >= 0) { [first, Math.min(low, high), Math.max(low, high), last].forEach(put); }
    first = -1;
  };
  for (let i = 0; i < t.length; i++) {
    const at = Math.floor((t[i] - end + span) / span * columns);
    if (at !== column || Number.isNaN(y[i])) {
      close();
      column = at;
    }
    if (Number.isNaN(y[i])) {
      if (made.y[made.y.length - 1] !== null) { put(i); }
    } else if (first < 0) {
      first = low = high = last = i;
    } else {
      last = i;
      if (y[i] < y[low]) { low = i; }
      if (y[i] > y[high]) { high = i; }
    }
  }
  close();
  return made;
}

// Every point, each pixel once.
function dots(c, s, colour, px, py, width, height) {
  const seen = new Uint8Array(width * height);
  c.fillStyle = colour;
  for (let i = 0; i < s.x.length; i++) {
    const x = px(s.x[i]), y = py(s.y[i]);
    if (x >= 0 && x < width && y >= 0 && y < height && seen[y * width + x] === 0) { // not so for NaN
      seen[y * width + x] = 1;
      c.fillRect(x - 0.8, y - 0.8, 1.6, 1.6);
    }
  }
}

// The samples of a series against time that are in a range.
function inside(s, [low, high]) {
  return { x: s.x, y: Array.from(s.y).filter((value, i) => s.x[i] >= low && s.x[i] <= high) };
}

const LEFT = 52, RIGHT = 10, TOP = 20;
const LEAST_DRAG = 6; // pixels; less is a click

class Plot {
  constructor(canvas) {
    this.canvas = canvas;
    this.series = [];
    this.options = {};
    this.pointer = null;
    this.from = null; // where a drag began
    this.part = null; // what is enlarged: {x: [low, high], y: the same or null}
    this.hidden = new Set();
    this.labels = []; // {label, left, right} of the legend
    canvas.tabIndex = 0;
    canvas.title = "Drag or +, - to enlarge; double click or 0 for all; arrows or the pointer to read values; " +
      "a click on a name or 1 to 9 to hide a trace";
    const redraw = () => this.paint();
    canvas.addEventListener("pointerdown", (event) => {
      if (event.offsetY < TOP) {
        this.toggle(this.labels.find((one) => event.offsetX >= one.left && event.offsetX <= one.right)?.label);
      } else if (event.button === 0) {
        this.from = { x: event.offsetX, y: event.offsetY };
      }
    });
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = event.offsetX;
      this.to = { x: event.offsetX, y: event.offsetY };
      redraw();
    });
    canvas.addEventListener("pointerup", (event) => {
      const from = this.from;
      this.from = null;
      if (from && this.box && Math.abs(event.offsetX - from.x) >= LEAST_DRAG) {
        this.enlarge(from, { x: event.offsetX, y: event.offsetY });
      } else {
        redraw();
      }
    });
    canvas.addEventListener("pointerleave", () => {
      this.pointer = this.from = null;
      redraw();
    });
    canvas.addEventListener("dblclick", () => this.all());
    canvas.addEventListener("blur", () => {
      this.pointer = null;
      redraw();
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(redraw).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  }

  key(event) {
    if (!this.box || event.ctrlKey || event.altKey || event.metaKey) { return; }
    const { left, right } = this.box, middle = this.pointer ?? (left + right) / 2;
    const named = this.series.filter((one) => one.label);
    const zoom = (by) => {
      const reach = by * (right - left) / 2;
      this.enlarge({ x: middle - reach, y: null }, { x: middle + reach, y: null });
    };
    if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
      const step = (event.key === "ArrowLeft" ? -1 : 1) * (event.shiftKey ? 50 : 5);
      this.pointer = Math.max(left, Math.min(right, middle + step));
      this.paint();
    } else if (event.key === "+" || event.key === "=") {
      zoom(0.5);
    } else if (event.key === "-") {
      zoom(2);
    } else if (event.key === "0") {
      this.all();
    } else if (event.key >= "1" && event.key <= "9" && named[event.key - 1]) {
      this.toggle(named[event.key - 1].label);
    } else {
      return;
    }
    event.preventDefault();
  }

  toggle(label) {
    if (label === undefined) { return; }
    if (!this.hidden.delete(label)) { this.hidden.add(label); }
    this.paint();
  }

  // The part between two points of the canvas; of a loop in both directions, against time in y what is there.
  enlarge(a, b) {
    const { left, right, top, bottom } = this.box, [x, y] = this.axes;
    const between = (range, from, to, one, two) => [one, two].map((at) =>
      range[0] + (at - from) / (to - from) * (range[1] - range[0])).sort((low, high) => low - high);
    const part = between(x, left, right, a.x, b.x), least = 1e-9 * Math.max(Math.abs(part[0]), Math.abs(part[1]));
    if (!(part[1] - part[0] > least)) { return; }
    const flat = a.y === null || this.options.values || Math.abs(a.y - b.y) < LEAST_DRAG;
    if (!this.part) { // a live trace's samples are moved on below it
      this.series = this.series.map((s) => ({ ...s, x: Array.from(s.x), y: Array.from(s.y) }));
    }
    this.part = { x: part, y: flat ? null : between(y, bottom, top, a.y, b.y) };
    this.paint();
  }

  all() {
    this.part = null;
    this.paint();
  }

  // Pixels that a plot is wide inside.
  columns() {
    return Math.max(1, this.canvas.clientWidth - LEFT - RIGHT);
  }

  // options: {x: [low, high], least: smallest extent of y, values: show values at the pointer,
  // empty: what to say without values}
  draw(series, options = {}) {
    if (this.part && options.live) { return; }
    this.series = series;
    this.options = options;
    this.paint();
  }

  // The series that are not hidden.
  shown() {
    return this.series.filter((s) => !this.hidden.has(s.label));
  }

  paint() {
    const options = this.options, series = this.shown();
    const canvas = this.canvas, scale = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (width === 0) { return; }
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
    }
    const style = getComputedStyle(canvas), c = canvas.getContext("2d");
    const colour = (name) => style.getPropertyValue(name);
    const x = this.part ? this.part.x : options.x || rangeOf(series, "x", 1e-9);
    const y = this.part?.y || rangeOf(this.part ? series.map((s) => inside(s, x)) : series, "y", options.least || 1e-3);
    const box = { left: LEFT, right: width - RIGHT, top: TOP, bottom: height - 22 };
    this.box = box;
    this.axes = [x, y];
    canvas.dataset.x = x.join(" "); // for who tests the page
    canvas.dataset.hidden = [...this.hidden].join(" ");
    const px = (value) => box.left + (value - x[0]) / (x[1] - x[0]) * (box.right - box.left);
    const py = (value) => box.bottom - (value - y[0]) / (y[1] - y[0]) * (box.bottom - box.top);
    c.setTransform(scale, 0, 0, scale, 0, 0);
    c.clearRect(0, 0, width, height);
    c.font = "12px system-ui, sans-serif";
    c.lineWidth = 1;
    c.strokeStyle = colour("--grid");
    c.fillStyle = colour("--soft");
    c.textAlign = "right";
    c.textBaseline = "middle";
    for (const tick of ticksOf(y[0], y[1], Math.max(2, (box.bottom - box.top) / 40))) {
      c.beginPath();
      c.moveTo(box.left, py(tick.value));
      c.lineTo(box.right, py(tick.value));
      c.stroke();
      c.fillText(tick.text, box.left - 6, py(tick.value));
    }
    c.textAlign = "center";
    c.textBaseline = "top";
    for (const tick of ticksOf(x[0], x[1], Math.max(2, (box.right - box.left) / 110))) {
      c.beginPath();
      c.moveTo(px(tick.value), box.top);
      c.lineTo(px(tick.value), box.bottom);
      c.stroke();
      c.fillText(tick.text, Math.min(px(tick.value), width - 14), box.bottom + 5);
    }
    c.save();
    c.beginPath();
    c.rect(box.left, box.top - 1, box.right - box.left, box.bottom - box.top + 2);
    c.clip();
    for (const s of series) {
      if (s.dots) {
        dots(c, s, colour(s.colour), (value) => Math.round(px(value)), (value) => Math.round(py(value)), width, height);
        continue;
      }
      c.strokeStyle = colour(s.colour);
      c.lineWidth = 1.6;
      c.setLineDash(s.dash ? [5, 4] : []);
      c.beginPath();
      let open = false;
      for (let i = 0; i < s.x.length; i++) {
        if (s.y[i] === null || Number.isNaN(s.y[i])) {
          open = false;
        } else if (open) {
          c.lineTo(px(s.x[i]), py(s.y[i]));
        } else {
          c.moveTo(px(s.x[i]), py(s.y[i]));
          open = true;
        }
      }
      c.stroke();
    }
    c.setLineDash([]);
    c.restore();
    if (options.empty && series.every((s) => s.y.every((value) => value === null))) {
      c.fillStyle = colour("--soft");
      c.textAlign = "center";
      c.fillText(options.empty, (box.left + box.right) / 2, (box.top + box.bottom) / 2);
    }
    this.legend(c, colour, box);
    if (this.from && this.to && Math.abs(this.to.x - this.from.x) >= LEAST_DRAG) {
      c.fillStyle = colour("--grid");
      c.globalAlpha = 0.5;
      c.fillRect(Math.min(this.from.x, this.to.x), box.top, Math.abs(this.to.x - this.from.x), box.bottom - box.top);
      c.globalAlpha = 1;
    }
    if (this.part) {
      c.fillStyle = colour("--soft");
      c.textAlign = "right";
      c.textBaseline = "bottom";
      const back = options.live ? "held: double click or 0 for live" : "double click or 0 for all";
      c.fillText(back, box.right, box.bottom - 2);
    }
    if (this.pointer !== null && options.values) { this.values(c, colour, box, x, px); }
  }

  legend(c, colour, box) {
    c.textAlign = "left";
    c.textBaseline = "middle";
    let at = box.left;
    this.labels = [];
    for (const s of this.series.filter((one) => one.label)) {
      c.strokeStyle = colour(s.colour);
      c.lineWidth = 2;
      c.setLineDash(s.dash ? [5, 4] : []);
      c.beginPath();
      c.moveTo(at, 9);
      c.lineTo(at + 18, 9);
      c.stroke();
      const wide = c.measureText(s.label).width;
      c.fillStyle = colour(this.hidden.has(s.label) ? "--soft" : "--ink");
      c.fillText(s.label, at + 23, 9);
      if (this.hidden.has(s.label)) { c.fillRect(at, 9, 23 + wide, 1); }
      this.labels.push({ label: s.label, left: at, right: at + 23 + wide });
      at += 23 + wide + 16;
    }
    c.setLineDash([]);
  }

  // A line at the pointer, and what each series has there.
  values(c, colour, box, x, px) {
    const at = x[0] + (this.pointer - box.left) / (box.right - box.left) * (x[1] - x[0]);
    const texts = [];
    for (const s of this.shown().filter((one) => one.x.length > 0)) {
      let low = 0, high = s.x.length - 1; // times grow
      while (low < high) {
        const middle = (low + high) >> 1;
        if (s.x[middle] < at) { low = middle + 1; } else { high = middle; }
      }
      if (s.y[low] !== null) { texts.push((s.label ? `${s.label} ` : "") + s.y[low].toFixed(4)); }
    }
    if (at < x[0] || at > x[1] || texts.length === 0) { return; }
    c.strokeStyle = colour("--soft");
    c.lineWidth = 1;
    c.beginPath();
    c.moveTo(px(at), box.top);
    c.lineTo(px(at), box.bottom);
    c.stroke();
    this.canvas.dataset.read = texts.join(", ");
    const text = `${at.toFixed(4)} s: ${texts.join(", ")}`;
    const room = c.measureText(text).width + 8;
    const left = Math.max(box.left, Math.min(px(at) + 4, box.right - room));
    c.fillStyle = colour("--paper");
    c.fillRect(left, box.top, room, 18);
    c.fillStyle = colour("--ink");
    c.textAlign = "left";
    c.textBaseline = "middle";
    c.fillText(text, left + 4, box.top + 9);
  }
}
