// SPDX-License-Identifier: GPL-3.0-or-later
// Line plots on a canvas. A series is {x: [..], y: [..], colour: "--position", label, dash}; null in y is a gap.
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
    const box = { left: 52, right: width - 10, top: 20, bottom: height - 22 };
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
      c.strokeStyle = colour(s.colour);
      c.lineWidth = 1.6;
      c.setLineDash(s.dash ? [5, 4] : []);
      c.beginPath();
      let open = false;
      for (let i = 0; i < s.x.length; i++) {
        if (s.y[i] === null) {
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
