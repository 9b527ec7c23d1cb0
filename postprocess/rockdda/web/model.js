// SPDX-License-Identifier: MIT
// Shows a model before any run, and follows its files as they are edited: lines, blocks, regions, boundaries, water,
// stages, and the messages of `rockdda check` at their places. The local server of `rockdda-post view` gives the data.
"use strict";

const $ = (id) => document.getElementById(id);
const setup = JSON.parse($("setup").textContent);
const canvas = $("picture"), pen = canvas.getContext("2d");
const PALETTE = setup.palette, FILLS = setup.materials;
const SIGNS = { error: "#d55e00", warning: "#e69f00", note: "#0072b2" };
const KINDS = { fixed: "#000000", roller: "#000000", moving: "#009e73", traction: "#d55e00", viscous: "#7b3294", free_field: "#7b3294" };
let model = setup.model, version = setup.version;
let chosen = -1, marked = -1; // stage (-1: as drawn) and message
let view = null, fitted = true, drawn = 0;

function text(value) {
  const size = Math.abs(value);
  return value === 0 ? "0" : size >= 1e5 || size < 1e-3 ? value.toExponential(3) : String(Number(value.toPrecision(5)));
}

// ---- the picture -----------------------------------------------------------------------------------------------

function fit() {
  fitted = true;
  const [low, high] = model.box || [[0, 0], [1, 1]], box = canvas.getBoundingClientRect(), margin = 40;
  const scale = Math.min((box.width - 2 * margin) / (high[0] - low[0] || 1), (box.height - 2 * margin) / (high[1] - low[1] || 1));
  view = { scale: Math.max(scale, 1e-12), x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2 };
}

const at = ([x, y]) => [canvas.clientWidth / 2 + (x - view.x) * view.scale, canvas.clientHeight / 2 - (y - view.y) * view.scale];

function line(points, close = false) {
  points.forEach((point, k) => pen[k ? "lineTo" : "moveTo"](...at(point)));
  if (close) pen.closePath();
}

function stroke(colour, width, dash, work) {
  pen.strokeStyle = colour; pen.lineWidth = width; pen.setLineDash(dash);
  pen.beginPath(); work(); pen.stroke(); pen.setLineDash([]);
}

function absent() { // blocks that the chosen stage has taken out, or that are not yet placed
  const gone = new Set(), of = (name) => model.regions.filter((r) => r.name.trim().toLowerCase() === name).flatMap((r) => r.blocks);
  if (chosen < 0) return gone;
  model.stages.forEach((stage, k) => {
    if (k > chosen) for (const name of stage.place) of(name).forEach((block) => gone.add(block));
  });
  model.stages.slice(0, chosen + 1).forEach((stage) => {
    for (const name of stage.excavate) of(name).forEach((block) => gone.add(block));
  });
  return gone;
}

function tables() { // of the water that acts in the chosen stage
  const named = model.stages.slice(0, chosen + 1).map((stage) => stage.water).filter((name) => name !== null);
  const now = named[named.length - 1];
  return model.water.filter((water) => chosen < 0 || now === undefined || water.name.trim().toLowerCase() === now);
}

function label(words, place, colour = "#1d232a") {
  if (!$("names").checked || !place) return;
  pen.font = "12px system-ui, sans-serif"; pen.textAlign = "center"; pen.textBaseline = "middle";
  const [x, y] = at(place), wide = pen.measureText(words).width + 8;
  pen.fillStyle = "#ffffffd0"; pen.fillRect(x - wide / 2, y - 9, wide, 18);
  pen.fillStyle = colour; pen.fillText(words, x, y + 1);
}

function middle(points) {
  const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]);
  return points.length ? [(Math.min(...xs) + Math.max(...xs)) / 2, (Math.min(...ys) + Math.max(...ys)) / 2] : null;
}

function drawBlocks(gone) {
  const { offset, vertices, material } = model.blocks, buckets = new Map();
  material.forEach((number, i) => {
    const key = gone.has(i) ? "gone" : (number - 1) % FILLS.length;
    if (!buckets.has(key)) buckets.set(key, []);
    buckets.get(key).push(i);
  });
  const small = view.scale * Math.hypot(model.box[1][0] - model.box[0][0], model.box[1][1] - model.box[0][1]) / Math.sqrt(material.length) < 5;
  for (const [key, blocks] of buckets) {
    for (let begin = 0; begin < blocks.length; begin += 50) {
      pen.beginPath();
      for (const i of blocks.slice(begin, begin + 50)) line(vertices.slice(offset[i], offset[i + 1]), true);
      pen.fillStyle = key === "gone" ? "#ffffff" : `${FILLS[key]}66`;
      pen.fill();
      pen.strokeStyle = key === "gone" ? "#c4c9ce" : "#8a939b"; pen.lineWidth = small ? 0.2 : 0.6;
      if (key === "gone") pen.setLineDash([3, 3]);
      pen.stroke(); pen.setLineDash([]);
    }
  }
}

function drawBoundary({ kind, along }) {
  const colour = KINDS[kind] || "#000000";
  stroke(colour, 4, kind === "viscous" || kind === "free_field" ? [6, 4] : [], () => line(along));
  for (let k = 1; k < along.length; k++) {
    const [x1, y1] = at(along[k - 1]), [x2, y2] = at(along[k]), long = Math.hypot(x2 - x1, y2 - y1) || 1;
    const n = Math.max(1, Math.min(40, Math.round(long / 18))), [tx, ty] = [(x2 - x1) / long, (y2 - y1) / long];
    for (let i = 0; i < n; i++) {
      const x = x1 + ((i + 0.5) / n) * (x2 - x1), y = y1 + ((i + 0.5) / n) * (y2 - y1);
      stroke(colour, 1.2, [], () => {
        if (kind === "roller") pen.arc(x, y, 4, 0, 2 * Math.PI);
        else { pen.moveTo(x - 4 * ty - 4 * tx, y + 4 * tx - 4 * ty); pen.lineTo(x + 4 * ty + 4 * tx, y - 4 * tx + 4 * ty); }
      });
      if (kind === "roller") { pen.fillStyle = "#ffffff"; pen.fill(); }
    }
  }
  label(kind, middle(along), colour);
}

function drawPoints() {
  const shape = (place, draw) => { const [x, y] = at(place); pen.beginPath(); draw(x, y); pen.closePath(); pen.fill(); pen.stroke(); };
  pen.strokeStyle = "#000000"; pen.lineWidth = 1.2;
  for (const [x1, y1, x2, y2] of model.fixed) {
    if (x1 !== x2 || y1 !== y2) stroke("#8c510a", 3, [], () => line([[x1, y1], [x2, y2]]));
    pen.fillStyle = "#ffffff"; pen.strokeStyle = "#000000"; pen.lineWidth = 1.2;
    shape([x1, y1], (x, y) => { pen.moveTo(x, y - 5); pen.lineTo(x - 5, y + 4); pen.lineTo(x + 5, y + 4); });
  }
  pen.fillStyle = "#000000";
  for (const point of model.loading) shape(point, (x, y) => { pen.moveTo(x, y + 5); pen.lineTo(x - 5, y - 4); pen.lineTo(x + 5, y - 4); });
  model.measured.forEach((point, k) => {
    pen.fillStyle = "#ffffff"; pen.strokeStyle = "#000000"; pen.lineWidth = 1.2;
    shape(point, (x, y) => pen.arc(x, y, 4, 0, 2 * Math.PI));
    pen.font = "11px system-ui, sans-serif"; pen.textAlign = "left"; pen.textBaseline = "middle"; pen.fillStyle = "#1d232a";
    const [x, y] = at(point);
    if (model.measured.length <= 40) pen.fillText(String(k + 1), x + 7, y);
  });
  for (const point of model.holes) {
    const [x, y] = at(point);
    stroke("#000000", 1.4, [], () => { pen.moveTo(x - 4, y - 4); pen.lineTo(x + 4, y + 4); pen.moveTo(x + 4, y - 4); pen.lineTo(x - 4, y + 4); });
  }
}

function drawSigns() { // messages where they belong
  model.messages.forEach(({ severity, place, isOptions }, k) => {
    if (!place || (severity === "note" && k !== marked)) return; // notes are where one looks for them
    const size = k === marked ? 13 : 9, [x, below] = at(place), y = below - (isOptions ? 20 : 0); // above the name of a region
    pen.beginPath(); pen.arc(x, y, size, 0, 2 * Math.PI);
    pen.fillStyle = SIGNS[severity] || SIGNS.note; pen.fill();
    pen.strokeStyle = "#ffffff"; pen.lineWidth = 2; pen.stroke();
    pen.font = `700 ${size + 3}px system-ui, sans-serif`; pen.textAlign = "center"; pen.textBaseline = "middle";
    pen.fillStyle = "#ffffff"; pen.fillText(severity === "note" ? "i" : "!", x, y + 1);
  });
}

function draw() {
  const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(box.width * ratio)); canvas.height = Math.max(1, Math.round(box.height * ratio));
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (fitted || !view) fit();
  pen.fillStyle = "#ffffff"; pen.fillRect(0, 0, box.width, box.height);
  if (model.blocks) {
    const gone = absent();
    document.body.dataset.gone = gone.size;
    if ($("blocks").checked) drawBlocks(gone);
    if ($("lines").checked) {
      model.lines.forEach(([x1, y1, x2, y2, material], k) => stroke(PALETTE[(material - 1) % PALETTE.length], k < model.boundaryLines ? 2 : 1, [],
        () => line([[x1, y1], [x2, y2]])));
      for (const [x1, y1, x2, y2, material] of model.materialLines) stroke(FILLS[(material - 1) % FILLS.length], 3, [3, 3], () => line([[x1, y1], [x2, y2]]));
    }
    for (const [x1, y1, x2, y2] of model.bolts) {
      stroke("#ffffff", 5, [], () => line([[x1, y1], [x2, y2]]));
      stroke("#b3006b", 2.2, [], () => line([[x1, y1], [x2, y2]]));
    }
    drawPoints();
  }
  for (const region of model.regions) stroke("#5b3a00", 1.6, [8, 4], () => line(region.ring, true));
  const [low, high] = model.box || [[0, 0], [1, 1]], margin = 0.03 * (high[0] - low[0]);
  for (const { table } of tables()) {
    if (!table.length) continue;
    const end = table[table.length - 1];
    stroke("#0072b2", 2, [9, 4], () => line([[Math.min(low[0] - margin, table[0][0]), table[0][1]], ...table, [Math.max(high[0] + margin, end[0]), end[1]]]));
  }
  for (const { along } of model.liners) for (const [colour, width] of [["#ffffff", 6], ["#1a1a1a", 3.2]]) stroke(colour, width, [], () => line(along));
  for (const boundary of model.boundaries) drawBoundary(boundary);
  for (const region of model.regions) label(region.name, middle(region.ring), "#5b3a00");
  for (const { name, along } of model.liners) label(name || "lining", along[Math.floor(along.length / 2)]);
  for (const { name, table } of tables()) label(name || "water", table[Math.floor(table.length / 2)], "#0072b2");
  drawSigns();
  document.body.dataset.water = tables().length;
  document.body.dataset.drawn = String(++drawn);
}

// ---- the side --------------------------------------------------------------------------------------------------

function element(kind, words, name = "") {
  const made = document.createElement(kind);
  made.textContent = words; made.className = name;
  return made;
}

function list() {
  const drawnStage = element("li", "as drawn", chosen < 0 ? "now" : "");
  drawnStage.onclick = () => choose(-1);
  $("steps").replaceChildren(drawnStage, ...model.stages.map((stage, k) => {
    const item = element("li", `${k + 1}  ${stage.name}`, k === chosen ? "now" : "");
    item.append(element("div", stage.words, "words"));
    item.onclick = () => { choose(k); reveal(stage.line); };
    return item;
  }));
  const errors = model.messages.filter((m) => m.severity === "error").length;
  $("count").textContent = model.messages.length ? `${errors} errors, ${model.messages.length - errors} warnings and notes` : "check: nothing to report";
  $("messages").replaceChildren(...model.messages.map((message, k) => {
    const item = element("li", message.message, `${message.severity}${k === marked ? " now" : ""}`);
    item.append(element("div", [message.file, message.line, message.column].filter(Boolean).join(":"), "words"));
    item.onclick = () => {
      marked = k; list(); draw();
      if (message.isOptions) reveal(message.line);
    };
    return item;
  }));
  $("file").textContent = model.text.length ? model.file.split("/").pop() : "";
  $("text").replaceChildren(...model.text.map((row, k) => {
    const here = model.messages.filter((m) => m.isOptions && m.line === k + 1), shown = element("span", "", here.length ? "marked" : "");
    shown.append(element("i", String(k + 1)), row);
    for (const message of here) shown.append(element("b", `▲ ${message.message}`));
    return shown;
  }));
  document.body.dataset.messages = model.messages.length;
  document.body.dataset.errors = errors;
  document.body.dataset.stages = model.stages.length;
  document.body.dataset.regions = model.regions.length;
  document.body.dataset.blocks = model.blocks ? model.blocks.material.length : 0;
  document.body.dataset.version = version;
}

function reveal(number) {
  const row = $("text").children[number - 1];
  if (!row) return;
  for (const other of $("text").children) other.classList.toggle("now", other === row);
  row.scrollIntoView({ block: "center" });
}

function choose(k) { chosen = Math.min(Math.max(k, -1), model.stages.length - 1); list(); draw(); }

// ---- hands -----------------------------------------------------------------------------------------------------

function zoom(factor, px, py) {
  fitted = false;
  view.x += ((px - canvas.clientWidth / 2) / view.scale) * (1 - 1 / factor);
  view.y += ((canvas.clientHeight / 2 - py) / view.scale) * (1 - 1 / factor);
  view.scale *= factor;
  draw();
}

function connect() {
  for (const name of ["lines", "blocks", "names"]) $(name).onchange = draw;
  $("fit").onclick = () => { fit(); draw(); };
  new ResizeObserver(draw).observe($("stage"));
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY); }, { passive: false });
  let from = null;
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); from = [event.offsetX, event.offsetY]; });
  canvas.addEventListener("pointermove", (event) => {
    const x = view.x + (event.offsetX - canvas.clientWidth / 2) / view.scale, y = view.y - (event.offsetY - canvas.clientHeight / 2) / view.scale;
    $("tip").textContent = `x ${text(x)}${model.length}, y ${text(y)}${model.length}`;
    if (!from) return;
    fitted = false;
    view.x -= (event.offsetX - from[0]) / view.scale; view.y += (event.offsetY - from[1]) / view.scale;
    from = [event.offsetX, event.offsetY];
    draw();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { from = null; });
  canvas.addEventListener("dblclick", () => { fit(); draw(); });
  window.addEventListener("keydown", (event) => {
    if (event.key === "0") { fit(); draw(); }
    else if (event.key === "[" || event.key === "]") choose(chosen + (event.key === "]" ? 1 : -1));
    else if (event.key === "Escape") { marked = -1; choose(-1); }
  });
}

async function follow() { // the files as they are edited
  try {
    const answer = await fetch(`state/${version}${location.search}`, { cache: "no-store" });
    if (!answer.ok) throw new Error(await answer.text());
    const news = await answer.json();
    if (news.version !== version) {
      ({ model, version } = news);
      chosen = Math.min(chosen, model.stages.length - 1); marked = -1;
      list(); draw();
    }
    $("error").textContent = "";
  } catch (error) {
    $("error").textContent = `no answer from rockdda-post view: ${error.message}`;
  }
  setTimeout(follow, 700);
}

connect(); list(); draw();
document.body.dataset.ready = "yes";
setTimeout(follow, 700);
