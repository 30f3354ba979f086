// SPDX-License-Identifier: GPL-3.0-or-later
// Line plots on a canvas. A series is {x: [..], y: [..], colour: "--position", label, dash, dots}; null or NaN in y is a
// gap; with dots each point is one, for more of them than lines can be drawn between.
"use strict";

// Steps of 1, 2 or 5 times a power of ten, about `most` of them.
function ticksOf(low, high, most) {
  const raw = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * (raw / power > 5 ? 10 : raw / power > 2 ? 5 : raw / power > 1 ? 2 : 1);
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

const LEFT = 52, RIGHT = 10;

class Plot {
  constructor(canvas) {
    this.canvas = canvas;
    this.series = [];
    this.pointer = null;
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = event.offsetX;
      this.draw(this.series, this.options);
    });
    canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      this.draw(this.series, this.options);
    });
    new ResizeObserver(() => this.draw(this.series, this.options)).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw(this.series, this.options));
  }

  // Pixels that a plot is wide inside.
  columns() {
    return Math.max(1, this.canvas.clientWidth - LEFT - RIGHT);
  }

  // options: {x: [low, high], least: smallest extent of y, values: show values at the pointer,
  // empty: what to say without values}
  draw(series, options = {}) {
    this.series = series;
    this.options = options;
    const canvas = this.canvas, scale = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (width === 0) { return; }
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
    }
    const style = getComputedStyle(canvas), c = canvas.getContext("2d");
    const colour = (name) => style.getPropertyValue(name);
    const x = options.x || rangeOf(series, "x", 1e-9), y = rangeOf(series, "y", options.least || 1e-3);
    const box = { left: LEFT, right: width - RIGHT, top: 20, bottom: height - 22 };
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
    for (const tick of ticksOf(x[0], x[1], Math.max(2, (box.right - box.left) / 80))) {
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
    if (this.pointer !== null && options.values) { this.values(c, colour, box, x, px); }
  }

  legend(c, colour, box) {
    c.textAlign = "left";
    c.textBaseline = "middle";
    let at = box.left;
    for (const s of this.series.filter((one) => one.label)) {
      c.strokeStyle = colour(s.colour);
      c.lineWidth = 2;
      c.setLineDash(s.dash ? [5, 4] : []);
      c.beginPath();
      c.moveTo(at, 9);
      c.lineTo(at + 18, 9);
      c.stroke();
      c.fillStyle = colour("--ink");
      c.fillText(s.label, at + 23, 9);
      at += 23 + c.measureText(s.label).width + 16;
    }
    c.setLineDash([]);
  }

  // A line at the pointer, and what each series has there.
  values(c, colour, box, x, px) {
    const at = x[0] + (this.pointer - box.left) / (box.right - box.left) * (x[1] - x[0]);
    const texts = [];
    for (const s of this.series.filter((one) => one.x.length > 0)) {
      let low = 0, high = s.x.length - 1; // times grow
      while (low < high) {
        const middle = (low + high) >> 1;
        if (s.x[middle] < at) { low = middle + 1; } else { high = middle; }
      }
      if (s.y[low] !== null) { texts.push(s.y[low].toFixed(4)); }
    }
    if (at < x[0] || at > x[1] || texts.length === 0) { return; }
    c.strokeStyle = colour("--soft");
    c.lineWidth = 1;
    c.beginPath();
    c.moveTo(px(at), box.top);
    c.lineTo(px(at), box.bottom);
    c.stroke();
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
