// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of a page: numbers under the pointer, zoom, data to copy. The page is whole without it, and on paper.
"use strict";
document.querySelectorAll("figure").forEach((figure) => {
  const svg = figure.querySelector("svg.plot"), source = figure.querySelector("script.data");
  if (!svg || !source) return;
  const data = JSON.parse(source.textContent);
  data.lines.forEach((line, i) => { line.x = line.x || data.lines[i - 1].x; });
  const [left, top, right, bottom] = data.frame, still = svg.firstElementChild;
  const log = data.log.map((is) => is === 1);
  let range = data.range.slice(), drawn = null, cursor = 0.5, start = null;

  const node = (parent, name, attributes, text) => {
    const made = document.createElementNS(svg.namespaceURI, name);
    Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
    if (text !== undefined) made.textContent = text;
    parent.appendChild(made);
    return made;
  };
  const html = (name, className, text) => {
    const made = document.createElement(name);
    made.className = className;
    made.textContent = text;
    return made;
  };
  const onAxis = (axis, value) => (log[axis] ? Math.log10(value) : value);
  const offAxis = (axis, value) => (log[axis] ? 10 ** value : value);
  const toX = (x) => left + (onAxis(0, x) - range[0]) / (range[1] - range[0]) * (right - left);
  const toY = (y) => bottom - (onAxis(1, y) - range[2]) / (range[3] - range[2]) * (bottom - top);
  const shown = (value) => {
    const text = String(Number(value.toPrecision(5)));
    return text.length < 11 ? text.replace("-", "\u2212") : value.toExponential(3).replace("-", "\u2212");
  };

  // Ticks at 1, 2, 5 times a power of ten; on a logarithmic axis at those, or at the powers only.
  const ticks = (axis) => {
    const low = range[2 * axis], high = range[2 * axis + 1], found = [];
    if (log[axis] && high - low > 0.7) {
      for (let p = Math.floor(low); p <= high; p++) {
        (high - low < 2 ? [1, 2, 5] : [1]).forEach((times) => found.push(times * 10 ** p));
      }
      const each = Math.ceil(found.length / 8);
      return found.filter((value, i) => i % each === 0 && onAxis(axis, value) >= low && onAxis(axis, value) <= high);
    }
    const from = offAxis(axis, low), to = offAxis(axis, high), rough = (to - from) / 5;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((times) => times * power).find((size) => size >= rough * 0.999) || 10 * power;
    for (let i = Math.ceil(from / step); i * step <= to; i++) found.push(i * step);
    return found;
  };

  const draw = () => {
    if (drawn) drawn.remove();
    const whole = range.every((value, i) => value === data.range[i]);
    still.style.display = whole ? "" : "none";
    drawn = node(svg, "g", {});
    svg.insertBefore(drawn, mark);
    if (whole) return;
    ticks(0).forEach((x) => {
      node(drawn, "path", { class: "grid", d: `M${toX(x)} ${top}V${bottom}` });
      node(drawn, "text", { class: "tick", x: toX(x), y: bottom + 16 }, shown(x));
    });
    ticks(1).forEach((y) => {
      node(drawn, "path", { class: "grid", d: `M${left} ${toY(y)}H${right}` });
      node(drawn, "text", { class: "tick level", x: left - 6, y: toY(y) + 4 }, shown(y));
    });
    const inside = node(drawn, "svg", { x: left, y: top, width: right - left, height: bottom - top,
      viewBox: `${left} ${top} ${right - left} ${bottom - top}` });
    data.lines.forEach((line) => node(inside, "polyline", { class: line.class,
      points: line.x.map((x, k) => `${toX(x).toFixed(1)},${toY(line.y[k]).toFixed(1)}`).join(" ") }));
    node(drawn, "path", { class: "axis", d: `M${left} ${top}V${bottom}H${right}` });
    still.querySelectorAll(".label").forEach((label) => drawn.appendChild(label.cloneNode(true)));
  };

  // Around the middle by a factor, within the whole; both axes, or x only.
  const zoom = (factor, x, y) => {
    [[0, x], [2, y]].forEach(([i, at]) => {
      if (at === null) return;
      const low = at - (at - range[i]) / factor, high = at + (range[i + 1] - at) / factor;
      range[i] = Math.max(low, data.range[i]);
      range[i + 1] = Math.min(high, data.range[i + 1]);
    });
    draw();
  };

  const mark = node(svg, "path", { class: "mark", d: "" }), box = node(svg, "rect", { class: "zoom", width: 0, height: 0 });
  const tools = html("div", "tools", ""), told = html("output", "told", "");
  const clear = html("button", "", "all of it"), give = html("button", "", "data");
  give.setAttribute("aria-expanded", "false");
  tools.append(told, clear, give);
  figure.insertBefore(tools, source);
  svg.setAttribute("tabindex", "0");
  told.textContent = "Drag over a part to enlarge it.";

  // The point of each line that is nearest to the pointer: along x where x grows all the way, else in the picture.
  const sorted = data.lines.map((line) => line.x.every((x, k) => k === 0 || x >= line.x[k - 1]));
  const tell = (px, py) => {
    const parts = [];
    let x = null;
    data.lines.forEach((line, i) => {
      let best = -1, least = Infinity;
      for (let k = 0; k < line.x.length; k++) {
        const dx = toX(line.x[k]) - px, dy = sorted[i] ? 0 : toY(line.y[k]) - py, far = dx * dx + dy * dy;
        if (far < least) { least = far; best = k; }
      }
      if (best < 0) return;
      x = x === null ? line.x[best] : x;
      parts.push(`${data.lines.length > 1 ? line.name + " " : ""}${shown(line.y[best])}`);
    });
    mark.setAttribute("d", `M${px} ${top}V${bottom}`);
    told.textContent = `${data.x.replace(/,.*/, "")} ${x === null ? "" : shown(x)}${data.x.replace(/^[^,]*,?/, "")}: ${
      parts.join(", ")}${data.y.replace(/^[^,]*,?/, "")}`;
  };
  const place = (event) => {
    const at = svg.getScreenCTM().inverse(), point = new DOMPoint(event.clientX, event.clientY).matrixTransform(at);
    return [Math.min(Math.max(point.x, left), right), Math.min(Math.max(point.y, top), bottom)];
  };
  const xAt = (px) => range[0] + (px - left) / (right - left) * (range[1] - range[0]);
  const yAt = (py) => range[2] + (bottom - py) / (bottom - top) * (range[3] - range[2]);

  svg.addEventListener("pointerdown", (event) => {
    start = place(event);
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    const [px, py] = place(event);
    tell(px, py);
    if (!start) return;
    box.setAttribute("x", Math.min(px, start[0]));
    box.setAttribute("y", Math.min(py, start[1]));
    box.setAttribute("width", Math.abs(px - start[0]));
    box.setAttribute("height", Math.abs(py - start[1]));
  });
  const release = () => {
    start = null;
    box.setAttribute("width", 0);
  };
  svg.addEventListener("pointercancel", release);
  svg.addEventListener("pointerup", (event) => {
    const from = start, [px, py] = place(event);
    release();
    if (!from || Math.abs(px - from[0]) < 8) return;
    const xs = [xAt(Math.min(px, from[0])), xAt(Math.max(px, from[0]))];
    const ys = [yAt(Math.max(py, from[1])), yAt(Math.min(py, from[1]))];
    range = [...xs, ...(Math.abs(py - from[1]) < 8 ? range.slice(2) : ys)];
    draw();
  });
  const reset = () => {
    range = data.range.slice();
    draw();
  };
  svg.addEventListener("dblclick", reset);
  clear.addEventListener("click", reset);
  svg.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.01, ArrowRight: 0.01 }[event.key];
    const factor = { "+": 2, "=": 2, "-": 0.5 }[event.key];
    if (step) cursor = Math.min(1, Math.max(0, cursor + step));
    else if (factor) zoom(factor, xAt(left + cursor * (right - left)), null);
    else if (event.key === "0" || event.key === "Escape") reset();
    else return;
    tell(left + cursor * (right - left), (top + bottom) / 2);
    event.preventDefault();
  });

  // The numbers, separated by tabs: a spreadsheet takes them as they are.
  give.addEventListener("click", () => {
    const there = figure.querySelector("textarea");
    give.setAttribute("aria-expanded", String(!there));
    if (there) { there.remove(); return; }
    const area = html("textarea", "numbers", "");
    area.readOnly = true;
    area.setAttribute("aria-label", `Data of ${data.title}`);
    area.value = data.lines.map((line) => {
      const thinned = line.of > line.x.length ? ` (${line.x.length} of ${line.of} samples, extremes among them)` : "";
      return `${data.x}\t${data.y}: ${line.name}${thinned}\n${line.x.map((x, k) => `${x}\t${line.y[k]}`).join("\n")}`;
    }).join("\n\n");
    figure.insertBefore(area, source);
    area.focus();
    area.select();
  });
});
// What is folded away is not folded on paper.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
