// SPDX-License-Identifier: GPL-3.0-or-later
// The live page: messages in, forms out (host_tools/serve/session.h, docs/LIVE.md).
"use strict";

const byId = (id) => document.getElementById(id);
const page = document.body.dataset; // what the page is in, also for tests: server, line, run, job, control
const MOST_ROWS = 1 << 20, MOST_SILENT = 4, AGAIN_MS = 700, DRAW_MS = 30;
const STREAM_MS = 300; // without a frame there is no stream
const stream = { heard: -Infinity, next: null }; // next: number of the frame that comes, once one has come
const plots = {};
for (const name of ["position", "loop", "drive", "error"]) { plots[name] = new Plot(byId(`plot-${name}`)); }
for (const name of ["time", "loop", "error"]) { plots[`compare-${name}`] = new Plot(byId(`compare-${name}`)); }
let socket = null, silent = 0, paused = false, stale = false, gone = false, line = {}, files = [], lastLive = null;
const compared = { a: null, b: null };

// ---- Small things ----

function put(id, text) {
  const element = byId(id);
  if (element.textContent !== text) { element.textContent = text; }
}

function number(value, unit, digits = 3) {
  return value === null || value === undefined ? "\u2013" : `${value.toFixed(digits)} ${unit}`;
}

function message(text, bad = false) {
  const box = byId("message");
  box.hidden = text === "";
  box.className = bad ? "bad" : "";
  put("message", text);
}

function element(name, text, attributes = {}) {
  const made = Object.assign(document.createElement(name), attributes);
  made.textContent = text;
  return made;
}

function table(into, head, rows) {
  const made = document.createElement("table");
  for (const [index, cells] of [head, ...rows].entries()) {
    const row = made.insertRow();
    for (const cell of cells) { row.append(element(index === 0 ? "th" : "td", cell)); }
  }
  byId(into).replaceChildren(made);
}

function send(object) {
  if (socket !== null && socket.readyState === WebSocket.OPEN) {
    socket.send(JSON.stringify(object));
    return true;
  }
  message("Not sent: there is no connection to the server.", true);
  return false;
}

// ---- What the page is in ----

function showBanner() {
  let text = "";
  if (page.server === "closed") {
    text = "No connection to the server: values are old, and nothing can be commanded, Stop included. " +
           "Is hyst serve still running? Trying again ..";
  } else if (page.line === "cut") {
    text = "The line to the amplifier is cut. What plays ends with its communication timeout, then it parks by " +
           `itself. Stop is sent as soon as the line is back. Trying again .. (${line.why || "no answer"})`;
  }
  byId("banner").hidden = text === "";
  put("banner", text);
}

function showState() {
  const texts = { connected: `line: ${line.port}`, cut: "line cut", unknown: "connecting" };
  put("line", page.server === "open" ? texts[page.line] : page.server === "closed" ? "no server" : "connecting");
  const able = page.control === "yes" && page.server === "open";
  for (const form of document.forms) {
    const needsLine = ["record", "track", "push", "clear"].includes(form.id);
    const busy = needsLine ? page.run !== "idle" || page.line !== "connected"
                           : form.id !== "" && page.job !== "idle";
    form.firstElementChild.disabled = form.id === "" ? page.server !== "open"
                                                     : !able || (busy && form.id !== "upload");
  }
  byId("viewer").hidden = page.server !== "open" || page.control === "yes";
  byId("cancel").hidden = page.job === "idle" || page.control !== "yes";
  byId("activity").hidden = page.run === "idle" && page.job === "idle";
  showBanner();
}

function enter(key, value) {
  page[key] = value;
  showState();
}

function activity(what, fraction) {
  put("activity-text", fraction === undefined ? what : `${what}, ${Math.round(100 * fraction)} %`);
  const bar = byId("activity-bar");
  if (fraction === undefined) { bar.removeAttribute("value"); } else { bar.value = fraction; }
}

// ---- Live ----

// The rows of the traces, in the order of time; a row of NaN is a gap.
const rows = { count: 0, t: new Float64Array(MOST_ROWS), reference: new Float32Array(MOST_ROWS),
  drive: new Float32Array(MOST_ROWS), position: new Float32Array(MOST_ROWS) };

function addRow(t, reference, drive, position) {
  if (rows.count === MOST_ROWS) { // the oldest quarter goes
    for (const key of ["t", "reference", "drive", "position"]) { rows[key].copyWithin(0, MOST_ROWS / 4); }
    rows.count -= MOST_ROWS / 4;
  }
  const at = rows.count++;
  rows.t[at] = t;
  rows.reference[at] = reference === null ? NaN : reference;
  rows.drive[at] = drive;
  rows.position[at] = position;
}

function addGap() {
  if (rows.count > 0) { addRow(rows.t[rows.count - 1], null, NaN, NaN); }
}

// The first row at or after this time.
function rowAt(t) {
  let low = 0, high = rows.count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows.t[middle] < t) { low = middle + 1; } else { high = middle; }
  }
  return low;
}

// Whether lines from sample to sample would be a scribble: on average they go over a tenth of the range, as a triangle
// of 20 samples a period does.
function jumps(values) {
  let way = 0, low = Infinity, high = -Infinity;
  for (let i = 1; i < values.length; i++) {
    if (!Number.isNaN(values[i] - values[i - 1])) { way += Math.abs(values[i] - values[i - 1]); }
    if (values[i] < low) { low = values[i]; }
    if (values[i] > high) { high = values[i]; }
  }
  return way > 0.1 * (high - low) * values.length;
}

function drawSoon() {
  if (!stale) {
    stale = true;
    setTimeout(() => requestAnimationFrame(drawLive), DRAW_MS);
  }
}

function onLive(event) {
  if (lastLive !== null && event.t < lastLive.t) { // another server
    rows.count = 0;
  }
  // Snapshots are the trace where no stream is; else the scales are placeholders.
  if (line.has_parameters && performance.now() - stream.heard > STREAM_MS) {
    const last = rows.count > 0 ? rows.t[rows.count - 1] : event.t;
    if (event.t - last > 0.5) { addGap(); } // a gap is not a line
    if (event.t >= last) { addRow(event.t, event.reference, event.drive, event.position); }
  }
  lastLive = event;
  drawSoon();
}

// Each frame once: what does not follow on what there is, is a gap.
function onStream(event) {
  const lost = event.lost > 0 || (stream.next !== null && !event.restarted && event.first !== stream.next);
  stream.heard = performance.now();
  stream.next = event.first + event.drive.length;
  if (event.lost > 0) { page.losses = Number(page.losses || 0) + 1; } // of frames on the line to the amplifier
  if (lost) { page.gaps = Number(page.gaps || 0) + 1; }
  if (!line.has_parameters) { return; }
  rows.count = rowAt(event.t); // snapshots that came before it
  if (lost || (event.restarted && rows.count > 0 && event.t - rows.t[rows.count - 1] > 0.2)) { addGap(); }
  for (let i = 0; i < event.drive.length; i++) {
    addRow(event.t + i * event.step, event.reference === null ? null : event.reference[i], event.drive[i], event.position[i]);
  }
  drawSoon();
}

// What warns now, else what did; and how far the model is off, once that is watched.
function warningText(now) {
  const before = now.warnings_before;
  const text = now.warnings.length > 0 ? now.warnings.join("; ")
                                       : before.length > 0 ? `none now; before: ${before.join("; ")}` : "none";
  return now.model_error === null || !line.has_parameters ? text
                                                          : `${text} (the model is off by ${number(now.model_error, "um")} rms)`;
}

function drawLive() {
  stale = false;
  const now = lastLive;
  if (now === null) { return; }
  const scaled = (value, unit) => line.has_parameters ? number(value, unit) : "no scale yet";
  put("now-reference", scaled(now.reference, "um"));
  put("now-position", scaled(now.position, "um"));
  put("now-error", scaled(now.error, "um"));
  put("now-drive", scaled(now.drive, "V"));
  put("now-mode", now.mode);
  put("now-state", now.state);
  put("power", `amplifier ${now.power}`);
  byId("clear").hidden = now.power !== "in fault";
  put("now-limits", now.limits.length > 0 ? now.limits.join(", ") : "none");
  byId("limits-box").className = now.limits.length > 0 ? "alarm" : "";
  const before = now.faults_before.filter((one) => !now.faults.includes(one));
  put("now-faults", now.faults.length > 0 ? now.faults.join(", ")
                                          : before.length > 0 ? `none now; before: ${before.join(", ")}` : "none");
  byId("faults-box").className = now.faults.length > 0 ? "alarm" : "";
  put("now-warnings", warningText(now));
  byId("warnings-box").className = now.warnings.length > 0 ? "warned" : "";
  if (paused || rows.count === 0) { return; }
  const span = Number(byId("window").value), end = rows.t[rows.count - 1], x = [-span, 0];
  const first = rowAt(end - span), t = rows.t.subarray(first, rows.count);
  const part = (key) => rows[key].subarray(first, rows.count);
  const position = part("position"), drive = part("drive"), reference = part("reference");
  const against = (y, name) => envelope(t, y, end, span, plots[name].columns());
  plots.position.draw([{ ...against(reference, "position"), colour: "--reference", label: "reference", dash: true },
    { ...against(position, "position"), colour: "--position", label: "position" }], { x, live: true, least: 0.2, values: true });
  plots.drive.draw([{ ...against(drive, "drive"), colour: "--drive" }], { x, live: true, least: 1, values: true });
  plots.error.draw([{ ...against(position.map((value, i) => value - reference[i]), "error"), colour: "--error" }],
    { x, live: true, least: 0.02, values: true, empty: "no reference is followed" });
  const loop = { x: drive, y: position, colour: "--position", dots: t.length > 4 * plots.loop.columns() || jumps(drive) };
  plots.loop.draw([loop], { x: rangeOf([loop], "x", 1), live: true, least: 0.2 });
}

// ---- Files ----

function kindOf(name) {
  return (files.find((file) => file.name === name) || {}).kind;
}

function fill(select) {
  const kept = select.value;
  const options = files.filter((file) => select.dataset.kind.split(" ").includes(file.kind)).map((file) => file.name);
  select.replaceChildren(...(select.dataset.none ? [new Option(select.dataset.none, "")] : []),
    ...options.map((name) => new Option(name, name)));
  if (kept !== "" && options.includes(kept)) {
    select.value = kept;
  } else if (select.dataset.none === undefined) { // rather what a model is fitted to than a track
    select.value = options.find((name) => !/-(linear|compensate)(-\d+)?\.csv$|^simulated/.test(name)) || options[0] || "";
  }
}

function choose(form, name, value) {
  const select = byId(form).querySelector(`[name="${name}"]`);
  if ([...select.options].some((option) => option.value === value)) { select.value = value; }
  if (name === "recording") { offerColumns(select.form, false); }
}

// To insist on the columns of a recording, once they were refused as exchanged; the next one is another matter.
function offerColumns(form, offered) {
  const box = form.elements.columns_are_right;
  if (box) {
    box.checked = box.checked && offered;
    box.parentElement.hidden = !offered;
  }
}

// Of another day than today the time alone says nothing.
function whenChanged(date) {
  return date.toDateString() === new Date().toDateString() ? date.toLocaleTimeString() : date.toLocaleDateString();
}

function onFiles(event) {
  files = event.files;
  document.querySelectorAll("select[data-kind]").forEach(fill);
  const rows = files.map((file) => {
    const row = document.createElement("tr");
    const name = document.createElement("td"), action = document.createElement("td");
    name.append(file.kind === "measurements" ? file.name // which the server does not give out
                                             : element("a", file.name, { href: `file/${file.name}`, download: file.name }));
    const act = { recording: ["Show", () => compare(file.name, "")], report: ["Open", () => openReport(file.name)] };
    if (act[file.kind]) {
      const button = element("button", act[file.kind][0], { type: "button" });
      button.setAttribute("aria-label", `${act[file.kind][0]} ${file.name}`);
      button.addEventListener("click", act[file.kind][1]);
      action.append(button);
    }
    row.append(name, element("td", file.kind), element("td", `${Math.max(1, Math.round(file.bytes / 1024))} kB`),
      element("td", whenChanged(new Date(1000 * file.changed))), action);
    return row;
  });
  byId("files").replaceChildren(...rows);
  if (rows.length === 0) { byId("files").append(element("caption", "Nothing yet: record something.")); }
}

function openReport(name) {
  byId("report").hidden = false;
  byId("report").dataset.name = name;
  byId("report-frame").src = `file/${name}`;
  byId("report-link").href = `file/${name}`;
  byId("report-link").textContent = `${name}, in a tab`;
  byId("report").scrollIntoView();
}

// ---- Files of this computer: announced by a message, and sent to the address that answers it ----

const sending = { files: [], file: null, name: null, request: null, looked: null };

function bring(list) {
  if (page.control !== "yes" || page.server !== "open") {
    message("Not brought: this page has no control.", true);
    return;
  }
  sending.files.push(...list);
  sendNext();
}

function sendNext() {
  if (sending.file === null) {
    sending.file = sending.files.shift() || null;
    if (sending.file !== null) { send({ do: "upload", name: sending.file.name, bytes: sending.file.size }); }
  }
  byId("sending").hidden = sending.file === null;
  byId("sending-bar").value = 0;
  put("sending-text", sending.file === null ? "" : sending.file.name);
  page.upload = sending.file === null ? "idle" : "sending";
}

// With this one; and with the others, if they are not to come either.
function sendingEnded(others = false) {
  if (sending.request !== null) { sending.request.abort(); }
  sending.file = sending.name = sending.request = null;
  if (others) { sending.files = []; }
  sendNext();
}

function onUpload(event) {
  if (sending.file === null) { return; } // cancelled meanwhile
  const request = new XMLHttpRequest();
  sending.name = event.name;
  sending.request = request;
  request.upload.addEventListener("progress", (at) => { byId("sending-bar").value = at.loaded / at.total; });
  for (const kind of ["error", "load"]) {
    request.addEventListener(kind, () => {
      if (request.status !== 200 && sending.request === request) {
        message(`${sending.file.name} did not reach the server. Can this computer still read it?`, true);
        sending.request = null;
        sendingEnded();
      }
    });
  }
  request.open("POST", event.to);
  request.send(sending.file);
}

// What is in it? The one that came last says so by itself, if nothing else is computed.
function onUploaded(event) {
  const mine = event.name === sending.name;
  if (mine) {
    sending.request = null;
    sendingEnded();
  }
  if (!event.good) {
    if (mine) { message(`upload: ${event.why}`, true); }
    return;
  }
  message(`${event.name} is in the folder.`);
  const kind = kindOf(event.name);
  if (kind !== "recording") { propose(event.name, kind); } // which may not say yet what its columns are
  if (mine && page.upload === "idle" && page.job === "idle" && ["recording", "measurements"].includes(kind)) {
    choose("import", "file", event.name);
    sending.looked = kind === "recording" ? event.name : null;
    send({ do: "import", file: event.name, write: false });
  }
}

// ---- Runs and jobs ----

// A new file, where it is of use.
function propose(name, kind) {
  const uses = { recording: [["fit", "recording"], ["diagnose", "recording"]], image: [["push", "image"]],
    model: [["compile", "model"], ["diagnose", "model"], ["simulate", "model"]] };
  for (const [form, field] of uses[kind] || []) { choose(form, field, name); }
}

function showResult(text, bad) {
  byId("result").hidden = false;
  put("result-text", text);
  byId("result-text").className = bad ? "bad" : "";
  if (page.run === "idle" && page.job === "idle") { message(text, bad); }
}

function trackTable(tracks) {
  const rows = tracks.map((track) => [track.mode === "linear" ? "before (linear)" : "after (compensate)",
    number(track.nrmse_percent, "%", 3), number(track.max_error_um, "um", 4), number(track.rms_error_um, "um", 4)]);
  table("result-table", ["", "NRMSE", "worst error", "RMS error"], rows);
}

function onRun(event) {
  if (event.running) {
    activity(event.what ? `${event.name}: ${event.what}` : event.name, event.fraction);
    enter("run", event.name);
    return;
  }
  const before = page.run;
  enter("run", "idle");
  if (event.good === undefined || (before === "idle" && byId("result").dataset.run === JSON.stringify(event))) {
    return;
  }
  byId("result").dataset.run = JSON.stringify(event);
  byId("result").dataset.good = event.good;
  byId("result").dataset.name = event.name;
  byId("result-table").replaceChildren();
  byId("job-text").hidden = true;
  const fault = event.note ? ` Note: ${event.note}.` : "";
  if (!event.good) {
    showResult(`${event.name}: ${event.why}` + fault, true);
    return;
  }
  const r = event.result, limited = r && (r.samples_with || {});
  if (event.name === "record") {
    showResult(`Recorded ${event.made[0]}: ${r.samples} samples at ${r.sample_rate_hz.toFixed(1)} Hz, drive ` +
      `${r.drive_v[0].toFixed(2)} to ${r.drive_v[1].toFixed(2)} V, displacement ${r.displacement_um[0].toFixed(3)} to ` +
      `${r.displacement_um[1].toFixed(3)} um.` + notes(limited) + fault, false);
    afterFiles.push(() => {
      propose(event.made[0], "recording");
      compare(event.made[0], "");
    });
  } else if (event.name === "track") {
    const both = r.tracks.length === 2;
    const times = both ? r.tracks[0].nrmse_percent / r.tracks[1].nrmse_percent : NaN;
    showResult(`Tracked ${event.made.join(" and ")}.` +
      (isFinite(times) ? ` The error is ${times.toFixed(1)} times less after than before.` : "") +
      notes(r.tracks[r.tracks.length - 1].samples_with) + fault, false);
    trackTable(r.tracks);
    afterFiles.push(() => compare(event.made[0], both ? event.made[1] : ""));
  } else {
    showResult({ push: "The image is in force, and read back the same.", clear: "The fault is cleared." }[event.name],
      false);
  }
}

// What ran into a limit.
function notes(counters) {
  const counted = Object.entries(counters).filter(([, count]) => count > 0);
  const texts = counted.map(([name, count]) => `${count} samples ${name.replaceAll("_", " ")}`);
  return texts.length > 0 ? ` Note: ${texts.join(", ")}.` : "";
}

const afterFiles = []; // to do when the list of files has come

// What a command has printed, its files by their names in the folder.
function printed(text) {
  const folder = page.folder || ".";
  return folder === "." ? text : text.replaceAll(`${folder}/`, "");
}

// Its line about what is wrong.
function reason(text) {
  const line = text.split("\n").find((one) => one.startsWith("hyst: "));
  return line === undefined ? "." : `: ${line.slice("hyst: ".length)}`;
}

function onJob(event) {
  const text = byId("job-text");
  byId("result").hidden = false;
  text.textContent = printed(event.text || "");
  text.hidden = text.textContent === "";
  if (event.running) {
    byId("result-table").replaceChildren();
    activity(event.name);
    enter("job", event.name);
    showResult(`${event.name} ..`, false);
    return;
  }
  const before = page.job;
  enter("job", "idle");
  byId("result").dataset.good = event.good;
  byId("result").dataset.name = event.name;
  showResult(event.good ? `${event.name} is done${event.made.length > 0 ? `: ${event.made.join(", ")}` : ""}.`
                        : event.cancelled ? `${event.name} was cancelled.`
                                          : `${event.name} has failed${reason(text.textContent)}`, !event.good);
  const looked = sending.looked; // brought, and now found to say what its columns are
  sending.looked = null;
  if (!event.good && text.textContent.includes("--columns-are-right")) { offerColumns(byId(event.name), true); }
  if (!event.good || before === "idle") { return; }
  if (looked !== null) {
    propose(looked, "recording");
    compare(looked, "");
  }
  afterFiles.push(() => {
    for (const name of event.made) {
      const kind = kindOf(name);
      if (kind !== "recording" || event.name === "import") { propose(name, kind); } // not a model's answer
      if (kind === "report") { openReport(name); }
      if (kind === "recording") { compare(name, ""); }
    }
  });
}

// ---- Compare ----

function compare(a, b) {
  const form = byId("compare").querySelector("form");
  form.elements.a.value = a;
  form.elements.b.value = b;
  compared.a = compared.b = null;
  compared.names = [a, b];
  for (const name of new Set([a, b])) {
    if (name !== "") { send({ do: "show", name }); }
  }
}

function onRecording(event) {
  if (!compared.names) { return; }
  if (event.name === compared.names[0]) { compared.a = event; }
  if (event.name === compared.names[1]) { compared.b = event; }
  if (compared.names.some((name, i) => name !== "" && compared["ab"[i]] === null)) { return; }
  drawCompared();
}

function drawCompared() {
  const shown = [["a", "A", "--drive"], ["b", "B", "--after"]].filter(([key]) => compared[key] !== null);
  byId("compared").hidden = shown.length === 0;
  byId("compared").dataset.shown = compared.names.join(" ");
  const time = [], loop = [], error = [], rows = [];
  for (const [key, name, colour] of shown) {
    const r = compared[key];
    const t = r.drive.map((_, i) => r.start_s + i * r.step / r.sample_rate_hz);
    if (r.reference && time.length === 0) {
      time.push({ x: t, y: r.reference, colour: "--reference", label: "reference", dash: true });
    }
    time.push({ x: t, y: r.displacement, colour, label: name });
    loop.push({ x: r.drive, y: r.displacement, colour, label: name, dots: jumps(r.drive) });
    if (r.reference) {
      error.push({ x: t, y: r.displacement.map((value, i) => value - r.reference[i]), colour, label: name });
    }
    rows.push([`${name}: ${r.name}`, number(r.nrmse_percent, "%", 3), number(r.max_error_um, "um", 4),
      number(r.rms_error_um, "um", 4), `${r.samples}`, `${r.sample_rate_hz.toFixed(1)} Hz`]);
  }
  table("compare-table", ["", "NRMSE", "worst error", "RMS error", "samples", "rate"], rows);
  plots["compare-time"].draw(time, { values: true });
  plots["compare-loop"].draw(loop);
  byId("compare-error-box").hidden = error.length === 0;
  plots["compare-error"].draw(error, { values: true });
}

// ---- Messages ----

const handlers = {
  hello(event) {
    page.folder = event.folder;
    put("folder", `In ${event.folder === "." ? "the folder where hyst serve was started," : event.folder} ` +
                  "on the machine of the server.");
    if (event.simulated) { byId("amplifier").dataset.simulated = "The amplifier is emulated, the actuator simulated. "; }
    const form = byId("record").elements;
    for (const [name, range] of [["drive", event.drive_range], ["position", event.position_range]]) {
      if (range[0] < range[1] && form[`${name}_low`].value === "") {
        [form[`${name}_low`].value, form[`${name}_high`].value] = range;
      }
    }
  },
  role(event) {
    byId("take").hidden = !event.free;
    enter("control", event.control ? "yes" : "no");
  },
  line(event) {
    line = event;
    if (event.connected) {
      const range = event.drive_v.map((value) => value.toFixed(1));
      put("amplifier", (byId("amplifier").dataset.simulated || "") + `Board ${event.board}, ` +
        `${event.sample_rate_hz} samples a second; ` + (event.has_parameters
        ? `drive ${range[0]} to ${range[1]} V; model ${event.model_id} is in force.` : "no parameters yet."));
      byId("ranges").hidden = event.has_parameters;
    }
    enter("line", event.connected ? "connected" : "cut");
  },
  live: onLive,
  stream: onStream,
  run: onRun,
  job: onJob,
  job_line(event) {
    byId("job-text").hidden = false;
    byId("job-text").append(`${printed(event.line)}\n`);
    byId("job-text").scrollTop = byId("job-text").scrollHeight;
  },
  job_progress(event) {
    if (page.job !== "idle" && page.run === "idle") { activity(`${page.job}: ${event.what}`, event.fraction); }
  },
  files(event) {
    onFiles(event);
    afterFiles.splice(0).forEach((act) => act());
  },
  recording: onRecording,
  upload: onUpload,
  uploaded: onUploaded,
  refused(event) {
    message(`${event.do || "The message"} was refused: ${event.why}`, true);
    if (event.do === "upload") { sendingEnded(); }
  },
  stopping() { message("Stopping .."); },
  stopped(event) {
    message(event.why ? `The amplifier did not take the stop: ${event.why}`
                      : `Stopped: the amplifier took it after ${Math.round(1000 * event.seconds)} ms. ` +
                        "The drive goes to rest, and the stage is switched off there.", Boolean(event.why));
    page.stops = Number(page.stops || 0) + 1;
  },
  beat() {},
};

function connect() {
  silent = 0;
  socket = new WebSocket(`ws://${location.host}${location.pathname}socket`, "hyst");
  socket.addEventListener("open", () => enter("server", "open"));
  socket.addEventListener("message", (received) => {
    silent = 0;
    const event = JSON.parse(received.data);
    if (handlers[event.event]) { handlers[event.event](event); }
  });
  socket.addEventListener("close", () => {
    page.line = "unknown";
    stream.next = null;
    page.run = page.job = "idle";
    sendingEnded(true);
    message("");
    enter("server", "closed");
    if (!gone) { setTimeout(connect, AGAIN_MS); }
  });
}

// Seconds in which nothing came and the page could have heard it: while it is busy no second is counted, and what came
// meanwhile waits. By the clock a slow page would take itself for a server that is gone, and Stop with it.
setInterval(() => {
  if (page.server === "open" && ++silent > MOST_SILENT) { socket.close(); }
}, 1000);
addEventListener("pagehide", () => {
  gone = true;
  socket.close();
});

// ---- Forms ----

function stop() {
  if (send({ do: "stop" })) { message("Stopping .."); }
}
byId("stop").addEventListener("click", stop);
addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    event.preventDefault();
    stop();
  }
}, true);
byId("take").addEventListener("click", () => send({ do: "take" }));
byId("cancel").addEventListener("click", () => send({ do: "cancel" }));
byId("upload").elements.files.addEventListener("change", (event) => {
  bring(event.target.files);
  event.target.value = ""; // the same file once more is a change again
});
byId("sending-cancel").addEventListener("click", () => sendingEnded(true));
let dragEnds = 0;
addEventListener("dragover", (event) => {
  if (!event.dataTransfer.types.includes("Files")) { return; }
  event.preventDefault();
  page.drag = "files";
  clearTimeout(dragEnds);
  dragEnds = setTimeout(() => { delete page.drag; }, 200); // it is told again and again while it lasts
});
addEventListener("drop", (event) => {
  if (event.dataTransfer.files.length === 0) { return; }
  event.preventDefault();
  bring(event.dataTransfer.files);
});
byId("pause").addEventListener("click", () => {
  paused = !paused;
  byId("pause").setAttribute("aria-pressed", paused);
  put("pause", paused ? "Go on" : "Pause");
});

// A sweep ends at a frequency, in a time; a multisine reaches up to one.
for (const form of [byId("record"), byId("track")]) {
  form.waveform.addEventListener("change", () => {
    const kind = form.waveform.value;
    form.end_frequency.parentElement.hidden = kind !== "sweep" && kind !== "multisine";
    form.sweep_time.parentElement.hidden = kind !== "sweep";
  });
}

for (const form of [byId("fit"), byId("diagnose")]) {
  form.recording.addEventListener("change", () => offerColumns(form, false));
}

// Numbers that were filled in, under their names.
function numbersOf(form, names) {
  const found = {};
  for (const name of names) {
    if (form[name].value !== "") { found[name] = Number(form[name].value); }
  }
  return found;
}

const requests = {
  record(form) {
    const [kind, probe] = form.waveform.value.split(":");
    const object = { do: "record", condition: form.condition.checked, name: form.name.value };
    if (kind === "probe") { object.probe = probe; } else {
      Object.assign(object, { waveform: kind },
        numbersOf(form, ["frequency", "cycles", "amplitude", "offset", "frames", "end_frequency", "sweep_time"]));
    }
    if (!line.has_parameters && form.drive_low.value !== "" && form.position_low.value !== "") {
      object.drive_range = [Number(form.drive_low.value), Number(form.drive_high.value)];
      object.position_range = [Number(form.position_low.value), Number(form.position_high.value)];
    }
    return object;
  },
  import(form, button) {
    const object = { do: "import", file: form.file.value, write: button !== "look",
      fill_missing: form.fill_missing.checked, drop_held: form.drop_held.checked,
      ...numbersOf(form, ["sample_rate_hz", "drive_scale", "displacement_scale"]) };
    for (const name of ["time", "drive", "displacement"]) {
      if (form[name].value !== "") { object[name] = form[name].value; }
    }
    return object;
  },
  track: (form) => ({ do: "track", waveform: form.waveform.value, mode: form.mode.value, name: form.name.value,
    condition: form.condition.checked, ...numbersOf(form, ["frequency", "cycles", "amplitude", "offset", "frames", "end_frequency", "sweep_time"]) }),
  clear: () => ({ do: "clear" }),
  push: (form) => ({ do: "push", image: form.image.value }),
  compile: (form) => ({ do: "compile", model: form.model.value }),
  fit: (form) => ({ do: "fit", recordings: [form.recording.value], creep: form.creep.checked,
    columns_are_right: form.columns_are_right.checked,
    ...(form.family.value === "" ? {} : { family: form.family.value }) }),
  diagnose: (form) => ({ do: "diagnose", recordings: [form.recording.value],
    columns_are_right: form.columns_are_right.checked,
    ...(form.model.value === "" ? {} : { model: form.model.value }) }),
  simulate(form, button) {
    const object = { do: button, model: form.model.value, recording: form.recording.value };
    const chosen = byId("compare").querySelector("form").elements;
    return button === "report" ? { ...object, before: chosen.a.value, after: chosen.b.value } : object;
  },
};
for (const form of document.forms) {
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    message("");
    if (form.id === "") {
      compare(form.elements.a.value, form.elements.b.value);
    } else if (requests[form.id]) {
      send(requests[form.id](form.elements, event.submitter && event.submitter.value));
    }
  });
}
// What is scrolled to comes below the header.
new ResizeObserver(([header]) => {
  document.documentElement.style.scrollPaddingTop = `${header.borderBoxSize[0].blockSize + 8}px`;
}).observe(document.querySelector("header"));
page.upload = "idle";
showState();
connect();
