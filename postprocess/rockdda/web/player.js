// SPDX-License-Identifier: MIT
// Plays the frames of a results file on a canvas: from data within this page (a film), or asking the local server that
// `rockdda-post view` runs. The address may say where to begin: #frame=12&field=stress_min&pick=3&enlarge=10
"use strict";

const $ = (id) => document.getElementById(id);
const setup = JSON.parse($("setup").textContent);
const hash = new URLSearchParams(location.hash.slice(1));
const WIDTH = 9; // numbers of a point along a joint: edge, both ends as shares of it, state, four fields, mobilised
const BOLT = 6, LINER = 8; // numbers of a piece: both ends, then force and share of a strength; share, N, M, Q
const STATES = ["open", "sliding", "locked or tied"];
const ofBlocks = (field) => field.joint === undefined;
const FORMER = { stress: "stress_min", velocity: "speed" }; // names of fields in older addresses

// ---- data ------------------------------------------------------------------------------------------------------

async function unpack(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Kind(await new Response(stream).arrayBuffer());
}

async function fetched(path) {
  const answer = await fetch(path + location.search, { cache: "no-store" }); // ?token=… of the address
  if (!answer.ok) throw new Error((await answer.text()) || `${path}: ${answer.status}`);
  return answer;
}

class Film { // everything is in the page, as whole numbers within ranges
  constructor(data) { this.data = data; this.values = {}; }
  async open() {
    this.moves = await unpack(this.data.moves.data, Int16Array);
    if (this.data.joints) this.jointRows = await unpack(this.data.joints.data, Float32Array);
    if (this.data.boltData) this.boltRows = await unpack(this.data.boltData, Float32Array);
    if (this.data.linerData) this.linerRows = await unpack(this.data.linerData, Float32Array);
  }
  async bolts(k) {
    const n = BOLT * this.data.bolts.length;
    return this.boltRows.subarray(k * n, (k + 1) * n);
  }
  async liners(k) {
    const n = LINER * this.data.liners.length;
    return this.linerRows.subarray(k * n, (k + 1) * n);
  }
  async joints(k) {
    const [begin, end] = this.data.joints.offset.slice(k, k + 2);
    return this.jointRows.subarray(WIDTH * begin, WIDTH * end);
  }
  async water(k) { return this.data.water[k]; }
  async displacement(k) {
    const n = 2 * this.data.vertices, unit = this.data.moves.unit, out = new Float32Array(n);
    for (let i = 0; i < n; i++) out[i] = unit * this.moves[k * n + i];
    return out;
  }
  async all(field) {
    if (!this.values[field.name]) {
      const whole = await unpack(field.data, Uint16Array), unit = (field.high - field.low) / 65535;
      this.values[field.name] = Float32Array.from(whole, (v) => field.low + unit * v);
    }
    return this.values[field.name];
  }
  async field(field, k) {
    const n = this.data.blocks;
    return (await this.all(field)).subarray(k * n, (k + 1) * n);
  }
  async limits(field) {
    if (field.joint !== undefined) return this.data.joints.ranges[field.name];
    return [field.low, field.high, ...field.usual];
  }
  async block(block) {
    const found = {};
    for (const field of this.data.fields.filter(ofBlocks)) {
      const values = await this.all(field);
      found[field.name] = this.data.times.map((_, k) => values[k * this.data.blocks + block]);
    }
    return found;
  }
  ahead() {}
  async poll() { return null; }
}

class Live { // a server on this machine
  constructor() { this.cache = new Map(); this.known = new Map(); }
  async open() {}
  floats(path) { // the promise is kept, so that what is on its way is not fetched twice
    if (!this.cache.has(path)) {
      if (this.cache.size > 64) this.cache.delete(this.cache.keys().next().value);
      const coming = fetched(path).then((answer) => answer.arrayBuffer()).then((bytes) => new Float32Array(bytes));
      coming.catch(() => this.cache.delete(path));
      this.cache.set(path, coming);
    }
    return this.cache.get(path);
  }
  json(path) { // what changes only when there are more frames
    const key = `${setup.times.length} ${path}`;
    if (!this.known.has(key)) {
      if (this.known.size > 32) this.known.delete(this.known.keys().next().value);
      const coming = fetched(path).then((answer) => answer.json());
      coming.catch(() => this.known.delete(key));
      this.known.set(key, coming);
    }
    return this.known.get(key);
  }
  displacement(k) { return this.floats(`displacement/${k}`); }
  field(field, k) { return this.floats(`field/${field.name}/${k}`); }
  bolts(k) { return this.floats(`bolts/${k}`); }
  liners(k) { return this.floats(`liners/${k}`); }
  joints(k) { return this.floats(`joints/${k}`); }
  water(k) { return this.json(`water/${k}`); }
  limits(field) { return this.json(`limits/${field.name}`); }
  block(block) { return this.json(`block/${block}`); }
  ahead(k) { // fetch the next frames before they are shown
    for (let next = k + 1; next <= Math.min(k + 4, setup.times.length - 1); next++) {
      const colours = ofBlocks(field) ? this.field(field, next) : this.joints(next);
      for (const coming of [this.displacement(next), colours, setup.bolts.length ? this.bolts(next) : null, setup.liners.length ? this.liners(next) : null]) {
        if (coming) coming.catch(() => {});
      }
    }
  }
  async poll() { return (await fetched("state")).json(); }
}

const source = setup.live ? new Live() : new Film(setup);
let offset, start;
let frame = 0, field = setup.fields[0], picked = -1, playing = false, limits = [0, 1], beyond = [0, 1];
let joints = null, water = null;
let next = null, owner = null; // of each vertex: the one after it on its block, and the block
let gone = null; // blocks that are not there: their vertices are all at one place
let moved, values, bolts = null, liners = null, drawn = 0; // moved: undefined until the first frame has come
let fitted = true; // the picture has not been zoomed or moved
let view = null; // scale in pixels per length, and the place at the middle of the canvas

// ---- numbers ---------------------------------------------------------------------------------------------------

function lengthText(value) { // in metres, where the units are known
  return setup.place ? text(value * setup.place.factor) + setup.place.unit : text(value);
}

function text(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(3).replace(/\.?0+e/, "e") : String(Number(value.toPrecision(5)));
}

function ticks(low, high, most) {
  const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 2.5, 5, 10].find((f) => f * power >= raw);
  const found = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9 * step; v += step) found.push(Math.abs(v) < 1e-9 * step ? 0 : v);
  return found;
}

const maps = {};
for (const [name, packed] of Object.entries(setup.maps)) {
  maps[name] = packed.match(/.{6}/g).map((hex) => `#${hex}`);
}

function mapOf(low, high) {
  return low < 0 && high > 0 && Math.min(-low, high) > 0.02 * Math.max(-low, high) ? "diverging"
    : high <= 0.02 * Math.max(-low, 0) ? "reversed" : "sequential";
}

// ---- the picture -----------------------------------------------------------------------------------------------

const canvas = $("picture"), pen = canvas.getContext("2d");

function resize(target, context) {
  const box = target.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
  const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
  if (target.width !== width || target.height !== height) { target.width = width; target.height = height; }
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [box.width, box.height];
}

function fit() {
  fitted = true;
  const [low, high] = setup.box, box = canvas.getBoundingClientRect();
  const right = scaleLayout().width + 4, margin = 24;
  const scale = Math.min((box.width - right - 2 * margin) / (high[0] - low[0] || 1), (box.height - 2 * margin) / (high[1] - low[1] || 1));
  view = { scale: Math.max(scale, 1e-12), x: (low[0] + high[0]) / 2 + right / 2 / scale, y: (low[1] + high[1]) / 2 };
}

function places(points) { // lengths to pixels
  const [width, height] = [canvas.clientWidth, canvas.clientHeight], out = new Float32Array(points.length);
  for (let i = 0; i < points.length; i += 2) {
    out[i] = width / 2 + (points[i] - view.x) * view.scale;
    out[i + 1] = height / 2 - (points[i + 1] - view.y) * view.scale;
  }
  return out;
}

function trace(path, at, i) {
  path.moveTo(at[2 * offset[i]], at[2 * offset[i] + 1]);
  for (let v = offset[i] + 1; v < offset[i + 1]; v++) path.lineTo(at[2 * v], at[2 * v + 1]);
  path.closePath();
}

// Paths of some blocks each: one path for each block is slow, one path for many thousands is slower.
function paint(blocks, at, finish) {
  for (let begin = 0; begin < blocks.length; begin += 50) {
    pen.beginPath();
    for (let k = begin; k < Math.min(begin + 50, blocks.length); k++) trace(pen, at, blocks[k]);
    finish();
  }
}

// Many small blocks are filled pixel by pixel, which is several times as fast as paths. A pixel belongs to the block that
// holds its middle.
const MANY = 4000;
let pixels = null;
function paintPixels(blocks, at, width, height, colourOf) {
  const ratio = canvas.width / width, wide = canvas.width, tall = canvas.height;
  if (!pixels || pixels.width !== wide || pixels.height !== tall) pixels = pen.createImageData(wide, tall);
  const target = new Uint32Array(pixels.data.buffer), cuts = [];
  target.fill(0xffffffff);
  for (const i of blocks) {
    const first = offset[i], last = offset[i + 1], colour = colourOf(i);
    let top = Infinity, bottom = -Infinity;
    for (let v = first; v < last; v++) { const y = at[2 * v + 1]; if (y < top) top = y; if (y > bottom) bottom = y; }
    const begin = Math.max(0, Math.ceil(top * ratio - 0.5)), end = Math.min(tall - 1, Math.floor(bottom * ratio - 0.5));
    for (let row = begin; row <= end; row++) {
      const y = (row + 0.5) / ratio;
      cuts.length = 0;
      for (let v = first, w = last - 1; v < last; w = v++) {
        const y1 = at[2 * v + 1], y2 = at[2 * w + 1];
        if (y1 > y !== y2 > y) cuts.push((at[2 * v] + ((at[2 * w] - at[2 * v]) * (y - y1)) / (y2 - y1)) * ratio - 0.5);
      }
      if (cuts.length > 2) cuts.sort((a, b) => a - b);
      for (let k = 0; k + 1 < cuts.length; k += 2) {
        const a = cuts[k] < cuts[k + 1] ? cuts[k] : cuts[k + 1], b = cuts[k] < cuts[k + 1] ? cuts[k + 1] : cuts[k];
        const from = row * wide + Math.max(0, Math.ceil(a)), to = row * wide + Math.min(wide, Math.ceil(b));
        for (let p = from; p < to; p++) target[p] = colour;
      }
    }
  }
  pen.putImageData(pixels, 0, 0);
}

const wordOf = (hex) => 0xff000000 + parseInt(hex.slice(5, 7) + hex.slice(3, 5) + hex.slice(1, 3), 16); // bytes R, G, B, A

function onScreen(at, width, height) { // the blocks that can be seen, and their mean size in pixels
  const seen = [];
  let size = 0;
  for (let i = 0; i < setup.blocks; i++) {
    if (gone[i]) continue;
    let [left, right, top, bottom] = [Infinity, -Infinity, Infinity, -Infinity];
    for (let v = offset[i]; v < offset[i + 1]; v++) {
      const x = at[2 * v], y = at[2 * v + 1];
      if (x < left) left = x;
      if (x > right) right = x;
      if (y < top) top = y;
      if (y > bottom) bottom = y;
    }
    if (right >= 0 && left <= width && bottom >= 0 && top <= height) {
      seen.push(i);
      size += right - left + bottom - top;
    }
  }
  return [seen, seen.length ? size / seen.length / 2 : 0];
}

function enlarged() {
  const factor = Number($("enlarge").value);
  return Number.isFinite(factor) ? factor : 1;
}

function present() { // vertices as shown
  const factor = enlarged(), out = new Float32Array(start.length);
  for (let v = 0, i = 0; v < owner.length; v++, i += 2) {
    const scale = gone[owner[v]] ? 1 : factor;
    out[i] = start[i] + scale * moved[i];
    out[i + 1] = start[i + 1] + scale * moved[i + 1];
  }
  return out;
}

function findGone() { // no block shrinks to a twentieth of its size; films keep places to about 1/30,000
  gone = new Uint8Array(setup.blocks);
  for (let i = 0; i < setup.blocks; i++) {
    let before = 0, now = 0; // squares
    for (let o = 2 * offset[i], v = o + 2; v < 2 * offset[i + 1]; v += 2) {
      const x = start[v] - start[o], y = start[v + 1] - start[o + 1];
      const u = x + moved[v] - moved[o], w = y + moved[v + 1] - moved[o + 1];
      before = Math.max(before, x * x + y * y);
      now = Math.max(now, u * u + w * w);
    }
    gone[i] = now < 0.0025 * before ? 1 : 0;
  }
}

function drawBolts() {
  if (!bolts) return;
  drawPieces(setup.bolts, bolts, BOLT, 2.6, (row) => useColour(bolts[row + 5], "#b3006b"));
}

function drawLiners() {
  if (!liners) return;
  const shown = $("liner").value, column = "NMQ".indexOf(shown), most = setup.linerRanges[column] || 1;
  drawPieces(setup.liners, liners, LINER, 4, (row) => {
    if (column < 0) return useColour(liners[row + 4], "#1a1a1a");
    const share = Math.min(Math.max(0.5 + liners[row + 5 + column] / most / 2, 0), 1);
    return maps.diverging[Math.round(share * (maps.diverging.length - 1))];
  });
}

function useColour(use, plain) { // plain: no strength is known
  return use < 0 ? plain : maps.use[Math.min(Math.floor(use * maps.use.length), maps.use.length - 1)];
}

function ends4(from, rows, row, factor) { // both ends of a piece [pixels]
  return places(from.map((v, j) => v + factor * (rows[row + j] - v)));
}

function drawPieces(pieces, rows, n, width, colourOf) { // the rim of all of them first: they join
  const factor = enlarged(), found = pieces.map((from, i) => ends4(from, rows, n * i, factor));
  for (const rim of [true, false]) {
    found.forEach(([x1, y1, x2, y2], i) => {
      if (Number.isNaN(x1)) return; // absent, or its rock is gone
      pen.strokeStyle = rim ? (n === LINER ? "#1a1a1a" : "#ffffff") : colourOf(n * i); pen.lineWidth = rim ? width + 2.4 : width;
      pen.beginPath(); pen.moveTo(x1, y1); pen.lineTo(x2, y2); pen.stroke();
    });
  }
}

// ---- what lies over the blocks ---------------------------------------------------------------------------------

function drawJoints(at, colours) { // pieces of edges end to end, the largest values last
  if (!joints) return;
  const column = 3 + field.joint, [low, high] = limits, pieces = [];
  for (let i = 0; i < joints.length; i += WIDTH) {
    const value = joints[i + column], open = joints[i + 3] === 0;
    const without = Number.isNaN(value) || (open && field.name !== "joint_opening" && field.map !== "states");
    pieces.push([i, without ? -1 : field.map === "states" ? value : Math.abs(value), without, value]);
  }
  pieces.sort((a, b) => a[1] - b[1]);
  const width = Math.min(5, Math.max(1.2, jointWidth));
  const stroke = (pieceList, colour, wide) => {
    pen.strokeStyle = colour; pen.lineWidth = wide;
    pen.beginPath();
    for (const [i] of pieceList) {
      const [x1, y1, x2, y2] = piece(at, i);
      pen.moveTo(x1, y1); pen.lineTo(x2, y2);
    }
    pen.stroke();
  };
  stroke(pieces.filter((p) => p[2]), "#9a9a9a", 0.4 * width);
  const shown = pieces.filter((p) => !p[2]);
  if (field.map !== "states") stroke(shown, "#6e6e6e", width + 0.8); // beneath colours of which zero is white
  let run = [], colour = null;
  for (const p of shown) {
    const share = Math.min(Math.max((p[3] - low) / (high - low || 1), 0), 1);
    const here = field.map === "states" ? colours[p[3]] : colours[Math.round(share * (colours.length - 1))];
    if (here !== colour && run.length) { stroke(run, colour, width); run = []; }
    colour = here; run.push(p);
  }
  if (run.length) stroke(run, colour, width);
  document.body.dataset.joints = `${shown.length} ${pieces.length}`;
}

let jointWidth = 2.4;
function piece(at, i) { // both ends of a point's part of its joint [pixels]
  const a = joints[i], b = next[a], [s, t] = [joints[i + 1], joints[i + 2]];
  const [ax, ay, dx, dy] = [at[2 * a], at[2 * a + 1], at[2 * b] - at[2 * a], at[2 * b + 1] - at[2 * a + 1]];
  return [ax + s * dx, ay + s * dy, ax + t * dx, ay + t * dy];
}

function jointAt(px, py) { // the row of the nearest piece within some pixels
  if (ofBlocks(field) || !joints || !moved) return -1;
  const at = places(present());
  let best = 7, found = -1;
  for (let i = 0; i < joints.length; i += WIDTH) {
    const [x1, y1, x2, y2] = piece(at, i), dx = x2 - x1, dy = y2 - y1, square = dx * dx + dy * dy;
    const share = square > 0 ? Math.min(Math.max(((px - x1) * dx + (py - y1) * dy) / square, 0), 1) : 0;
    const away = Math.hypot(px - x1 - share * dx, py - y1 - share * dy);
    if (away < best) { best = away; found = i; }
  }
  return found;
}

function arrow(x, y, dx, dy, length) { // with its tail at a place, along a unit vector [pixels]
  const [tx, ty] = [x + length * dx, y + length * dy], h = 0.4 * length;
  pen.moveTo(x, y); pen.lineTo(tx, ty);
  pen.moveTo(tx - h * (dx - 0.5 * dy), ty - h * (dy + 0.5 * dx));
  pen.lineTo(tx, ty); pen.lineTo(tx - h * (dx + 0.5 * dy), ty - h * (dy - 0.5 * dx));
}

const KINDS = { fixed: "#000000", roller: "#000000", moving: "#009e73", traction: "#d55e00", viscous: "#0072b2", free_field: "#0072b2" };
const DASHPOT = [[0, 0, 0.8, 0], [0.8, -0.3, 0.8, 0.3], [0.5, -0.5, 1.2, -0.5], [0.5, 0.5, 1.2, 0.5], [1.2, -0.5, 1.2, 0.5], [1.2, 0, 1.8, 0]];
function signOf(table, t) { // of the factor of a table t, factor, ... at a time; without a table 1
  if (!table || !table.length) return 1;
  let i = 2;
  while (i < table.length && table[i] < t) i += 2;
  if (t <= table[0] || i >= table.length) return Math.sign(table[t <= table[0] ? 1 : table.length - 1]);
  return Math.sign(table[i - 1] + ((t - table[i - 2]) / (table[i] - table[i - 2])) * (table[i + 1] - table[i - 1]));
}
function drawBoundaries(at) { // their edges, and symbols of so many pixels outside of the blocks
  const size = 7, { kinds, edges, tables } = setup.boundaries, moving = new Set();
  const signs = kinds.map((kind, i) => signOf(tables[i], setup.times[frame]));
  let count = 0;
  for (const [v, w, boundary, mode, ux, uy] of edges) {
    const kind = kinds[boundary], [x1, y1, x2, y2] = [at[2 * v], at[2 * v + 1], at[2 * w], at[2 * w + 1]];
    const length = Math.hypot(x2 - x1, y2 - y1);
    if (gone[owner[v]] || !(length > 0)) continue;
    const [tx, ty] = [(x2 - x1) / length, (y2 - y1) / length], [nx, ny] = [-ty, tx]; // outward, y downwards
    const n = Math.max(1, Math.round(length / (2.5 * size))), sign = signs[boundary];
    pen.strokeStyle = KINDS[kind] || "#000000"; pen.fillStyle = "#ffffff";
    pen.lineWidth = 2.2;
    pen.beginPath(); pen.moveTo(x1, y1); pen.lineTo(x2, y2); pen.stroke();
    pen.lineWidth = 1;
    if (kind === "free_field") {
      pen.beginPath(); pen.moveTo(x1 + 1.8 * size * nx, y1 + 1.8 * size * ny); pen.lineTo(x2 + 1.8 * size * nx, y2 + 1.8 * size * ny); pen.stroke();
    }
    for (let i = 0; i < n; i++) {
      const x = x1 + ((i + 0.5) / n) * (x2 - x1), y = y1 + ((i + 0.5) / n) * (y2 - y1);
      pen.beginPath();
      if (kind === "roller") {
        pen.arc(x + 3.5 * nx, y + 3.5 * ny, 2.5, 0, 2 * Math.PI);
        pen.fill();
      } else if (kind === "viscous" || kind === "free_field") {
        for (const [out, along, outer, beside] of DASHPOT) {
          pen.moveTo(x + size * (out * nx + along * tx), y + size * (out * ny + along * ty));
          pen.lineTo(x + size * (outer * nx + beside * tx), y + size * (outer * ny + beside * ty));
        }
      } else if (kind === "traction") {
        if (!mode || !sign) continue;
        const [dx, dy] = (mode === 3 ? [ux, -uy] : mode === 1 ? [-nx, -ny] : [nx, ny]).map((u) => sign * u), push = dx * nx + dy * ny, long = 2 * size;
        if (push < -0.1) arrow(x - long * dx, y - long * dy, dx, dy, long);
        else if (push > 0.1) arrow(x, y, dx, dy, long);
        else arrow(x + size * nx - size * dx, y + size * ny - size * dy, dx, dy, long);
      } else { pen.moveTo(x, y); pen.lineTo(x + size * (nx - tx), y + size * (ny - ty)); }
      pen.stroke();
      count++;
    }
    if (kind === "moving" && mode && sign && !moving.has(boundary)) {
      moving.add(boundary);
      const [dx, dy] = [sign * ux, -sign * uy];
      pen.lineWidth = 1.8;
      pen.beginPath(); arrow((x1 + x2) / 2 + 12 * nx - 14 * dx, (y1 + y2) / 2 + 12 * ny - 14 * dy, dx, dy, 28); pen.stroke();
    }
  }
  document.body.dataset.symbols = count;
}

function drawWater(at) { // pressure as bands, outside of free edges and inside at joints; tables
  if (!water || !$("water").checked) return;
  const widest = 0.08 * Math.max(setup.box[1][0] - setup.box[0][0], setup.box[1][1] - setup.box[0][1]) * view.scale;
  for (const [v, w, free, ...pairs] of water.bands) {
    const [x1, y1, x2, y2] = [at[2 * v], at[2 * v + 1], at[2 * w], at[2 * w + 1]], length = Math.hypot(x2 - x1, y2 - y1);
    if (!(length > 0)) continue;
    const side = ((free ? 1 : -1) * widest) / water.largest / length, [nx, ny] = [side * (y1 - y2), side * (x2 - x1)];
    pen.beginPath();
    const place = (s, p) => [x1 + s * (x2 - x1) + p * nx, y1 + s * (y2 - y1) + p * ny];
    pen.moveTo(...place(pairs[0], 0));
    for (let i = 0; i < pairs.length; i += 2) pen.lineTo(...place(pairs[i], pairs[i + 1]));
    pen.lineTo(...place(pairs[pairs.length - 2], 0));
    pen.fillStyle = "#56b4e98c"; pen.fill();
    pen.strokeStyle = "#0072b2"; pen.lineWidth = 0.8; pen.stroke();
  }
  pen.strokeStyle = "#0072b2"; pen.lineWidth = 1.6; pen.setLineDash([9, 4]);
  const [low, high] = setup.box, margin = 0.03 * (high[0] - low[0]);
  for (const table of water.tables) {
    const end = table.length - 2;
    const all = [Math.min(low[0] - margin, table[0]), table[1], ...table, Math.max(high[0] + margin, table[end]), table[end + 1]];
    const line = places(all);
    pen.beginPath();
    for (let i = 0; i < line.length; i += 2) pen.lineTo(line[i], line[i + 1]);
    pen.stroke();
  }
  pen.setLineDash([]);
  document.body.dataset.water = `${water.tables.length} ${water.bands.length}`;
}

function draw() {
  if (!moved) return; // the window has its size before the first frame is there
  const [width, height] = resize(canvas, pen);
  if (fitted) fit();
  pen.fillStyle = "#ffffff";
  pen.fillRect(0, 0, width, height);
  const at = places(present()), colours = maps[field.map || mapOf(...limits)], plain = !ofBlocks(field);
  const [seen, size] = onScreen(at, width, height);
  jointWidth = size / 6;
  const many = seen.length > MANY && size < 12 && !plain;
  document.body.dataset.pixels = many ? "yes" : "";
  if (many) {
    const words = colours.map(wordOf), most = colours.length - 1, [first, over] = [limits[0], limits[1] - limits[0] || 1];
    paintPixels(seen, at, width, height, field.map === "materials" ? (i) => words[(values[i] - 1) % words.length]
      : (i) => words[Math.round(Math.min(Math.max((values[i] - first) / over, 0), 1) * most)]);
  }
  if ($("outline").checked && frame > 0 && size > 3 && !many) {
    pen.strokeStyle = "#7a7a7a";
    pen.lineWidth = 0.7;
    pen.setLineDash([4, 3]);
    paint(Int32Array.from(gone.keys()), places(start), () => pen.stroke());
    pen.setLineDash([]);
  }
  const [low, high] = limits, span = high - low || 1;
  const buckets = new Map(); // blocks of one colour are painted together
  for (const i of plain || many ? [] : seen) {
    const share = Math.min(Math.max((values[i] - low) / span, 0), 1);
    const colour = field.map === "materials" ? (values[i] - 1) % colours.length : Math.round(share * (colours.length - 1));
    if (!buckets.has(colour)) buckets.set(colour, []);
    buckets.get(colour).push(i);
  }
  for (const [colour, blocks] of buckets) {
    pen.fillStyle = colours[colour];
    if (size < 3) { // too small for outlines: let no white show between the blocks
      pen.strokeStyle = colours[colour];
      pen.lineWidth = 0.5;
    }
    paint(blocks, at, () => { pen.fill(); if (size < 3) pen.stroke(); });
  }
  if (plain) { pen.fillStyle = "#f0f1f2"; paint(seen, at, () => pen.fill()); }
  if (size >= 3 && !(many && (playing || size < 6))) {
    pen.strokeStyle = plain ? "#a8a8a8" : "#333333";
    pen.lineWidth = Math.min(0.8, size / 16);
    paint(seen, at, () => pen.stroke());
  }
  if (picked >= 0) {
    const path = new Path2D();
    trace(path, at, picked);
    pen.strokeStyle = "#d55e00";
    pen.lineWidth = 3;
    pen.stroke(path);
  }
  drawWater(at);
  if (plain) drawJoints(at, colours);
  drawBoundaries(at);
  drawLiners();
  drawBolts();
  for (const [x, y] of setup.fixed) {
    const [px, py] = places([x, y]);
    pen.beginPath();
    pen.moveTo(px, py - 4); pen.lineTo(px - 4, py + 4); pen.lineTo(px + 4, py + 4); pen.closePath();
    pen.fillStyle = "#ffffff"; pen.strokeStyle = "#000000"; pen.lineWidth = 1;
    pen.fill(); pen.stroke();
  }
  drawMeasure();
  drawScale(width, height, colours);
  document.body.dataset.drawn = String(++drawn);
  tellOther();
}

// ---- a distance between two places, which move with the blocks where they are vertices ---------------------------

let measuring = false, ends = []; // each end a vertex, or a place

function setMeasuring(on) {
  measuring = on;
  if (on) ends = [];
  $("measure").classList.toggle("on", on);
  $("measure").setAttribute("aria-pressed", String(on));
  draw();
}

function endAt(px, py) { // the nearest vertex within some pixels, else the place
  const at = places(present());
  let best = 9, found = -1;
  for (let v = 0; v < owner.length; v++) {
    if (gone[owner[v]]) continue;
    const away = Math.hypot(at[2 * v] - px, at[2 * v + 1] - py);
    if (away < best) { best = away; found = v; }
  }
  if (found >= 0) return { vertex: found };
  return { place: [view.x + (px - canvas.clientWidth / 2) / view.scale, view.y - (py - canvas.clientHeight / 2) / view.scale] };
}

const placeOf = ({ vertex, place }, moves) => place || [0, 1].map((c) => start[2 * vertex + c] + (moves ? moved[2 * vertex + c] : 0));

function drawMeasure() {
  if (!ends.length) return;
  const shown = present(), drawnAt = ends.map((end) => places(end.place || [shown[2 * end.vertex], shown[2 * end.vertex + 1]]));
  pen.strokeStyle = pen.fillStyle = "#b3006b"; pen.lineWidth = 2;
  for (const [x, y] of drawnAt) { pen.beginPath(); pen.arc(x, y, 4, 0, 2 * Math.PI); pen.fill(); }
  if (ends.length < 2) { document.body.dataset.distance = ""; return; }
  const [[x1, y1], [x2, y2]] = drawnAt, now = ends.map((end) => placeOf(end, true)), before = ends.map((end) => placeOf(end, false));
  pen.beginPath(); pen.moveTo(x1, y1); pen.lineTo(x2, y2); pen.stroke();
  const [dx, dy] = [now[1][0] - now[0][0], now[1][1] - now[0][1]], distance = Math.hypot(dx, dy);
  const change = distance - Math.hypot(before[1][0] - before[0][0], before[1][1] - before[0][1]);
  const rows = [`${lengthText(distance)}  (${change >= 0 ? "+" : ""}${lengthText(change)} since the start)`, `Δx ${lengthText(dx)}, Δy ${lengthText(dy)}, ${(Math.atan2(dy, dx) * 180 / Math.PI).toFixed(1)}°`];
  pen.font = SCALE_FONT; pen.textAlign = "left"; pen.textBaseline = "middle";
  const wide = Math.max(...rows.map((row) => pen.measureText(row).width)) + 12;
  const x = Math.min(Math.max((x1 + x2) / 2 + 10, 4), canvas.clientWidth - wide - 4), y = Math.min(Math.max((y1 + y2) / 2 - 40, 4), canvas.clientHeight - 44);
  pen.fillStyle = "#ffffffe0"; pen.fillRect(x, y, wide, 38);
  pen.strokeStyle = "#b3006b"; pen.lineWidth = 1; pen.strokeRect(x, y, wide, 38);
  pen.fillStyle = "#1d232a";
  rows.forEach((row, k) => pen.fillText(row, x + 6, y + 11 + 17 * k));
  document.body.dataset.distance = `${distance} ${change}`;
}

// ---- two results side by side: this page is one of two frames, which do the same ----------------------------------

const paired = window.parent !== window && Boolean(setup.paired);
let hearing = 0, leads = false; // the page that was touched last leads
for (const kind of ["pointerdown", "wheel", "keydown", "input", "change"]) window.addEventListener(kind, () => { leads = true; }, { capture: true, passive: true });

function tellOther() {
  if (!paired || hearing || !leads) return;
  window.parent.postMessage({ time: setup.times[frame], field: field.name, view: fitted ? null : view, enlarge: $("enlarge").value,
    liner: $("liner").value, outline: $("outline").checked, water: $("water").checked, range: $("range").value, low: $("low").value, high: $("high").value }, location.origin);
}

async function hear(news) {
  hearing++; leads = false;
  setPlaying(false);
  try {
    fitted = !news.view;
    if (news.view) view = { ...news.view };
    const same = setup.fields.find((f) => f.name === news.field);
    if (same) { field = same; $("field").value = same.name; }
    for (const name of ["enlarge", "range", "low", "high", "liner"]) $(name).value = news[name];
    for (const name of ["outline", "water"]) $(name).checked = news[name];
    let best = 0;
    setup.times.forEach((time, k) => { if (Math.abs(time - news.time) <= Math.abs(setup.times[best] - news.time)) best = k; });
    await show(best);
  } finally { hearing--; }
}

const SCALE_FONT = "12px system-ui, sans-serif";

function wrapped(ink, words, most) { // lines of a text that are not wider than so many pixels
  const lines = [];
  for (const word of words.split(" ")) {
    const longer = lines.length ? `${lines[lines.length - 1]} ${word}` : word;
    if (lines.length && ink.measureText(longer).width <= most) lines[lines.length - 1] = longer; else lines.push(word);
  }
  return lines;
}

const labelWidth = () => (canvas.clientWidth < 600 ? 84 : 150); // beside a small picture labels have more lines

function scaleLayout() { // the colour scale: its ticks and how wide it is with all that is written on it
  const [low, high] = limits;
  pen.font = SCALE_FONT;
  const colours = maps[field.map || "sequential"];
  const marks = field.map === "states" ? STATES : field.map === "materials" ? Array.from({ length: Math.min(high, colours.length) }, (_, m) => String(m + 1))
    : (high > low ? ticks(low, high, 5) : [low]);
  const little = 0.02 * (high - low);
  const ends = field.map ? [] : [beyond[1] > high + little ? `▲ to ${text(beyond[1])}` : "", beyond[0] < low - little ? `▼ to ${text(beyond[0])}` : ""];
  const label = wrapped(pen, field.label, labelWidth());
  const widths = [...label, ...supportBars().flatMap((bar) => wrapped(pen, bar.label, labelWidth())), ...ends.filter(Boolean)].map((line) => pen.measureText(line).width);
  widths.push(...marks.map((v) => 22 + pen.measureText(typeof v === "string" ? v : text(v)).width));
  return { marks, ends, label, width: Math.ceil(Math.max(...widths)) + 20 };
}

function drawScale(width, height, colours) {
  const [low, high] = limits, { marks, ends, label, width: wide } = scaleLayout();
  const x = width - wide + 6, top = 16 + 15 * (label.length + (ends[0] ? 1 : 0)), further = supportBars()
    .map((bar) => 15 * wrapped(pen, bar.label, labelWidth()).length + 110);
  const tall = Math.max(40, Math.min(height - top - 60 - further.reduce((a, b) => a + b, 0), 320));
  pen.fillStyle = "#ffffffd8";
  pen.fillRect(x - 8, 6, wide, top + tall + 24);
  pen.font = SCALE_FONT;
  pen.fillStyle = "#1d232a";
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  label.forEach((line, i) => pen.fillText(line, x, 18 + 15 * i));
  if (field.map) {
    marks.forEach((name, m) => {
      pen.fillStyle = colours[m]; pen.fillRect(x, top + 20 * m, 14, 14);
      pen.fillStyle = "#1d232a"; pen.fillText(name, x + 22, top + 20 * m + 7);
    });
    return;
  }
  if (ends[0]) pen.fillText(ends[0], x, top - 9);
  if (ends[1]) pen.fillText(ends[1], x, top + tall + 12);
  drawBar(x, top, tall, colours, low, high, marks);
  document.body.dataset.scale = [x, x - 8 + wide, width].join(" ");
  let below = top + tall + 54;
  for (const bar of supportBars()) {
    const lines = wrapped(pen, bar.label, labelWidth());
    if (below + 15 * lines.length + 60 > height) break;
    pen.fillStyle = "#ffffffd8"; pen.fillRect(x - 8, below - 14, wide, 15 * lines.length + 100);
    pen.fillStyle = "#1d232a";
    lines.forEach((line, i) => pen.fillText(line, x, below + 15 * i));
    below += 15 * lines.length;
    const size = Math.min(80, height - below - 12);
    drawBar(x, below, size, bar.colours, bar.low, bar.high, ticks(bar.low, bar.high, 4));
    below += size + 30;
  }
}

function supportBars() { // the scales of the colours of bolts and linings
  const bars = [], known = (rows, n, k) => rows && rows.some((v, i) => i % n === k && v >= 0);
  const shown = $("liner").value, column = "NMQ".indexOf(shown), most = setup.linerRanges[column] || 1;
  const names = [known(bolts, BOLT, 5) ? "bolts" : "", column < 0 && known(liners, LINER, 4) ? "linings" : ""].filter(Boolean);
  if (names.length) bars.push({ label: `${names.join(", ")}: share of a strength [%]`, colours: maps.use, low: 0, high: 100 });
  if (column >= 0 && liners) {
    const unit = setup.linerUnits[column];
    bars.push({ label: `linings: ${shown}${unit && ` [${unit}]`}`, colours: maps.diverging, low: -most, high: most });
  }
  return bars;
}

function drawBar(x, top, tall, colours, low, high, marks) {
  for (let i = 0; i < colours.length; i++) {
    pen.fillStyle = colours[i];
    pen.fillRect(x, top + tall * (1 - (i + 1) / colours.length), 14, tall / colours.length + 1);
  }
  pen.fillStyle = "#1d232a"; pen.strokeStyle = "#1d232a"; pen.lineWidth = 0.8;
  for (const v of marks) {
    const y = top + tall * (1 - (v - low) / (high - low || 1));
    pen.beginPath(); pen.moveTo(x + 14, y); pen.lineTo(x + 18, y); pen.stroke();
    pen.fillText(text(v), x + 22, y);
  }
}

// ---- what is shown ---------------------------------------------------------------------------------------------

let wanted = 0;
async function show(k) { // the last request wins
  const ticket = ++wanted;
  const last = setup.times.length - 1;
  k = Math.min(Math.max(Math.round(k) || 0, 0), last);
  const asked = field;
  const [m, v, l, b, n, history, j, w] = await Promise.all([
    source.displacement(k), ofBlocks(asked) ? source.field(asked, k) : null, source.limits(asked),
    setup.bolts.length ? source.bolts(k) : null, setup.liners.length ? source.liners(k) : null, picked >= 0 ? source.block(picked) : null,
    ofBlocks(asked) ? null : source.joints(k), setup.hasWater ? source.water(k) : null,
  ]);
  if (ticket !== wanted) return;
  frame = k; moved = m; bolts = b; liners = n; joints = j; water = w;
  findGone();
  values = ofBlocks(asked) ? v : jointValues();
  beyond = $("range").value === "one" ? extremes(values) : l.slice(0, 2);
  setLimits(l);
  if (playing) source.ahead(k);
  $("slider").max = last;
  $("slider").value = k;
  const stage = setup.stageNames[setup.frameStages[k]];
  document.body.dataset.stage = stage || "";
  showStages();
  $("clock").textContent = (stage ? `${stage} · ` : "") + `t = ${text(setup.times[k])}${setup.unit} · step ${setup.steps[k]} · frame ${k} of ${last}`;
  document.body.dataset.frame = k;
  document.body.dataset.field = field.name;
  draw();
  if (picked >= 0 && history) showHistory(history);
}

function jointValues() { // of the chosen field, of joints that have one
  const found = [];
  for (let i = 0; i < joints.length; i += WIDTH) {
    const value = joints[i + 3 + field.joint];
    if (!Number.isNaN(value) && (joints[i + 3] > 0 || field.name === "joint_opening")) found.push(value);
  }
  return found.length ? Float32Array.from(found) : Float32Array.of(0, 1);
}

let marked = ""; // what the marks of stages were made of
function showStages() { // where stages begin, beneath the slider; a click shows the end of one
  const last = setup.times.length - 1, key = `${setup.frameStages}`;
  for (const mark of $("stages").children) mark.classList.toggle("now", Number(mark.dataset.stage) === setup.frameStages[frame]);
  if (!setup.stageNames.length || key === marked) return;
  marked = key;
  const found = [...new Set(setup.frameStages)].map((k) => {
    const begin = setup.frameStages.indexOf(k), end = setup.frameStages.lastIndexOf(k), mark = document.createElement("button");
    mark.type = "button";
    mark.textContent = setup.stageNames[k];
    mark.title = `${setup.stageNames[k]}: frames ${begin} to ${end}`;
    mark.dataset.stage = k;
    mark.style.left = `${(100 * begin) / (last || 1)}%`;
    mark.style.width = `${(100 * (end + (end < last ? 1 : 0) - begin)) / (last || 1)}%`;
    mark.onclick = () => { setPlaying(false); guarded(() => show(end)); };
    return mark;
  });
  $("stages").replaceChildren(...found);
  $("stages").hidden = false;
  for (const mark of $("stages").children) mark.classList.toggle("now", Number(mark.dataset.stage) === setup.frameStages[frame]);
}

function stageEnd(step) { // the last frame of the next stage, or of the one before
  const k = setup.frameStages[frame], ends = setup.frameStages.map((stage, i) => (stage !== setup.frameStages[i + 1] ? i : -1)).filter((i) => i >= 0);
  return step > 0 ? ends.find((i) => i > frame) ?? frame : [...ends].reverse().find((i) => setup.frameStages[i] < k) ?? 0;
}

function setLimits(known) { // of the colours: typed ones, those of the frame, or of all frames
  const range = $("range").value;
  let [low, high] = field.map ? known.slice(0, 2) : range === "one" ? extremes(values) : range === "all" ? known.slice(0, 2) : known.slice(2);
  if (!field.map && mapOf(low, high) === "diverging") { high = Math.max(-low, high); low = -high; }
  if (range === "typed" && !field.map) {
    const typed = [$("low"), $("high")].map((input) => (input.value.trim() === "" ? NaN : Number(input.value)));
    if (Number.isFinite(typed[0])) low = typed[0];
    if (Number.isFinite(typed[1])) high = typed[1];
  } else {
    $("low").value = Number(low.toPrecision(4));
    $("high").value = Number(high.toPrecision(4));
  }
  limits = [low, Math.max(low, high)];
  for (const name of ["low", "high"]) $(name).hidden = range !== "typed" || Boolean(field.map);
  document.body.dataset.limits = limits.join(" ");
}

function extremes(v) {
  let low = Infinity, high = -Infinity;
  for (const x of v) { if (x < low) low = x; if (x > high) high = x; }
  return [low, high];
}

function showHistory(history) { // the panel of the picked block; blocks count from 1, as in the input files
  $("picked").hidden = false;
  $("name").textContent = `block ${picked + 1}`;
  const rows = setup.fields.filter((f) => history[f.name]).map((f) => [f.label, text(history[f.name][frame])]);
  rows.push(["area at the start" + (setup.place ? ` [${setup.place.area[1]}]` : ""), text(setup.areas[picked] * (setup.place ? setup.place.area[0] : 1))]);
  $("values").replaceChildren(...rows.map(([name, value]) => {
    const row = document.createElement("tr");
    for (const content of [name, value]) row.appendChild(document.createElement("td")).textContent = content;
    return row;
  }));
  const charted = history[field.name] ? field : setup.fields[0];
  chart(history[charted.name] || [], charted.label);
}

function chart(history, label) {
  const target = $("chart"), ink = target.getContext("2d"), [width, height] = resize(target, ink);
  const right = 12, top = 20, bottom = 24, times = setup.times.slice(0, history.length);
  let [low, high] = extremes(history);
  if (!(high > low)) { low -= Math.abs(low) / 2 || 1; high += Math.abs(high) / 2 || 1; }
  ink.font = "11px system-ui, sans-serif";
  const heights = ticks(low, high, 4);
  const left = Math.ceil(Math.max(...heights.map((v) => ink.measureText(text(v)).width))) + 9;
  const t0 = times[0], t1 = times[times.length - 1] > t0 ? times[times.length - 1] : t0 + 1;
  const x = (t) => left + (width - left - right) * (t - t0) / (t1 - t0);
  const y = (v) => top + (height - top - bottom) * (1 - (v - low) / (high - low));
  ink.fillStyle = "#ffffff"; ink.fillRect(0, 0, width, height);
  ink.font = "11px system-ui, sans-serif"; ink.fillStyle = "#66707a"; ink.strokeStyle = "#e4e7e9"; ink.lineWidth = 1;
  ink.textAlign = "left"; ink.textBaseline = "top";
  ink.fillText(wrapped(ink, label, width)[0], 0, 2);
  ink.textAlign = "right"; ink.textBaseline = "middle";
  for (const v of heights) {
    ink.beginPath(); ink.moveTo(left, y(v)); ink.lineTo(width - right, y(v)); ink.stroke();
    ink.fillText(text(v), left - 5, y(v));
  }
  ink.textAlign = "center"; ink.textBaseline = "top";
  for (const t of ticks(t0, t1, 4)) {
    const half = ink.measureText(text(t)).width / 2;
    ink.fillText(text(t), Math.min(x(t), width - half - 1), height - bottom + 6);
  }
  ink.strokeStyle = "#0072b2"; ink.lineWidth = 1.6;
  ink.beginPath();
  history.forEach((v, k) => (k ? ink.lineTo(x(times[k]), y(v)) : ink.moveTo(x(times[k]), y(v))));
  ink.stroke();
  if (frame < history.length) {
    ink.fillStyle = "#d55e00";
    ink.beginPath(); ink.arc(x(times[frame]), y(history[frame]), 4, 0, 2 * Math.PI); ink.fill();
  }
  document.body.dataset.history = history.length;
}

function blockAt(px, py) {
  const at = places(present());
  for (let i = setup.blocks - 1; i >= 0; i--) {
    if (gone[i]) continue;
    let inside = false;
    for (let v = offset[i], w = offset[i + 1] - 1; v < offset[i + 1]; w = v++) {
      const [x1, y1, x2, y2] = [at[2 * v], at[2 * v + 1], at[2 * w], at[2 * w + 1]];
      if (y1 > py !== y2 > py && px < ((x2 - x1) * (py - y1)) / (y2 - y1) + x1) inside = !inside;
    }
    if (inside) return i;
  }
  return -1;
}

function pick(block) {
  picked = block;
  document.body.dataset.picked = block < 0 ? "" : block + 1;
  if (block < 0) { $("picked").hidden = true; resize(canvas, pen); }
  guarded(() => show(frame));
}

// ---- hands -----------------------------------------------------------------------------------------------------

function guarded(work) {
  return Promise.resolve().then(work).then(() => { $("error").textContent = ""; }, (error) => { $("error").textContent = String(error.message || error); });
}

let last = 0;
async function play(now) {
  if (!playing) return;
  if (now - last >= 1000 / Number($("speed").value)) {
    last = now;
    if (frame >= setup.times.length - 1) setPlaying(false); else await guarded(() => show(frame + 1));
  }
  requestAnimationFrame(play);
}

function setPlaying(on) {
  playing = on;
  $("play").textContent = on ? "❚❚" : "▶";
  if (!on) draw(); // with the outlines that are left out while many blocks move
  if (on) requestAnimationFrame(play);
}

function togglePlay() {
  if (!playing && frame >= setup.times.length - 1) guarded(() => show(0)).then(() => setPlaying(true)); else setPlaying(!playing);
}

function zoom(factor, px, py) {
  fitted = false;
  const dx = (px - canvas.clientWidth / 2) / view.scale, dy = (canvas.clientHeight / 2 - py) / view.scale;
  view.x += dx * (1 - 1 / factor);
  view.y += dy * (1 - 1 / factor);
  view.scale *= factor;
  draw();
}

function connect() {
  for (const [name, chosen] of [["blocks", setup.fields.filter(ofBlocks)], ["joints", setup.fields.filter((f) => !ofBlocks(f))]]) {
    const group = document.createElement("optgroup");
    group.label = name;
    group.append(...chosen.map((f) => new Option(f.label, f.name)));
    if (chosen.length) $("field").add(group);
  }
  $("water").parentElement.hidden = !setup.hasWater;
  $("water").onchange = () => draw();
  $("liner").parentElement.hidden = !setup.liners.length;
  $("liner").onchange = () => draw();
  $("field").onchange = () => { field = setup.fields[$("field").selectedIndex]; guarded(() => show(frame)); };
  $("range").onchange = () => guarded(() => show(frame));
  for (const name of ["low", "high"]) $(name).onchange = () => guarded(() => show(frame));
  $("enlarge").oninput = () => draw();
  $("outline").onchange = () => draw();
  $("slider").oninput = () => { setPlaying(false); guarded(() => show(Number($("slider").value))); };
  $("play").onclick = togglePlay;
  $("fit").onclick = () => { fit(); draw(); };
  $("unpick").onclick = () => pick(-1);
  $("measure").onclick = () => { setMeasuring(!measuring); $("measure").blur(); };
  $("help").onclick = () => { $("keys").hidden = !$("keys").hidden; $("help").blur(); };
  if (paired) window.addEventListener("message", (event) => { if (event.origin === location.origin && event.source === window.parent) guarded(() => hear(event.data)); });
  new ResizeObserver(() => draw()).observe($("stage"));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY);
  }, { passive: false });
  const fingers = new Map();
  let from = null, far = false;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    from = [event.offsetX, event.offsetY];
    far = fingers.size > 1;
  });
  canvas.addEventListener("pointermove", (event) => {
    const here = [event.offsetX, event.offsetY], before = fingers.get(event.pointerId);
    if (!before) { hover(here); return; }
    fingers.set(event.pointerId, here);
    if (fingers.size === 2) {
      const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
      zoom(Math.hypot(here[0] - other[0], here[1] - other[1]) / (Math.hypot(before[0] - other[0], before[1] - other[1]) || 1), ...other);
      return;
    }
    far ||= Math.hypot(here[0] - from[0], here[1] - from[1]) > 4;
    if (far) {
      fitted = false;
      view.x -= (here[0] - before[0]) / view.scale;
      view.y += (here[1] - before[1]) / view.scale;
      draw();
    }
  });
  const lift = (event) => {
    fingers.delete(event.pointerId);
    if (event.type !== "pointerup" || far) return;
    if (!measuring) { pick(blockAt(event.offsetX, event.offsetY)); return; }
    ends = [...(ends.length < 2 ? ends : []), endAt(event.offsetX, event.offsetY)];
    draw();
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("dblclick", () => { fit(); draw(); });
  window.addEventListener("keydown", (event) => {
    if (["INPUT", "SELECT"].includes(event.target.tagName) && event.target.type !== "range" && event.target.type !== "checkbox") return;
    const step = { ArrowRight: 1, ArrowLeft: -1, PageDown: 10, PageUp: -10, Home: -1e9, End: 1e9 }[event.key];
    if (step) { event.preventDefault(); setPlaying(false); guarded(() => show(frame + step)); }
    else if (event.key === " " && event.target.tagName !== "BUTTON") { event.preventDefault(); togglePlay(); }
    else if (event.key === "[" || event.key === "]") { setPlaying(false); guarded(() => show(stageEnd(event.key === "]" ? 1 : -1))); }
    else if (event.key === "0") { fit(); draw(); }
    else if (event.key === "m") setMeasuring(!measuring);
    else if (event.key === "?") $("keys").hidden = !$("keys").hidden;
    else if (event.key === "Escape") { $("keys").hidden = true; ends = []; setMeasuring(false); pick(-1); }
  });
}

function hover([px, py]) {
  const block = blockAt(px, py), row = jointAt(px, py);
  const x = view.x + (px - canvas.clientWidth / 2) / view.scale, y = view.y - (py - canvas.clientHeight / 2) / view.scale;
  $("tip").textContent = `x ${lengthText(x)}, y ${lengthText(y)}` + (row >= 0 ? jointText(row) : block >= 0 ? ` · block ${block + 1}` + (ofBlocks(field) ? `: ${field.label} ${text(values[block])}` : "") : "") + boltAt(px, py);
}

function nearest(pieces, rows, n, px, py) { // piece within some pixels, or -1
  const factor = enlarged();
  let best = 6, found = -1;
  pieces.forEach((from, i) => {
    const [x1, y1, x2, y2] = ends4(from, rows, n * i, factor), dx = x2 - x1, dy = y2 - y1;
    const share = Math.min(Math.max(((px - x1) * dx + (py - y1) * dy) / (dx * dx + dy * dy || 1), 0), 1);
    const away = Math.hypot(px - x1 - share * dx, py - y1 - share * dy);
    if (away < best) { best = away; found = i; }
  });
  return found;
}

function boltAt(px, py) { // name and forces of the nearest bolt and lining
  const used = (use) => (use >= 0 ? `, ${use < 10 ? Math.round(100 * use) : "> 1000"} % of ` : "");
  let found = "";
  const bolt = bolts ? nearest(setup.bolts, bolts, BOLT, px, py) : -1, part = liners ? nearest(setup.liners, liners, LINER, px, py) : -1;
  if (bolt >= 0) {
    const use = used(bolts[BOLT * bolt + 5]);
    found += ` · ${setup.boltNames[bolt]}: ${setup.boltLabel} ${text(bolts[BOLT * bolt + 4])}${use && use + "a strength"}`;
  }
  if (part >= 0) {
    const row = LINER * part, use = used(liners[row + 4]);
    const forces = ["N", "M", "Q"].map((name, i) => `${name} ${text(liners[row + 5 + i])} ${setup.linerUnits[i]}`.trim());
    found += ` · ${setup.linerNames[part]}: ${forces.join(", ")}${use && use + "its strength"}`;
  }
  return found;
}

function jointText(row) {
  const value = joints[row + 3 + field.joint], state = STATES[joints[row + 3]];
  return field.map === "states" ? ` · joint: ${state}` : ` · joint: ${Number.isNaN(value) ? "without a value" : `${field.label} ${text(value)}`} (${state})`;
}

async function follow() { // new frames of a running job
  try {
    const news = await source.poll();
    if (!news) return;
    const atEnd = frame === setup.times.length - 1;
    const grown = news.times.length > setup.times.length;
    setup.times = news.times;
    setup.steps = news.steps;
    setup.frameStages = news.frameStages;
    $("state").textContent = news.state;
    $("state").classList.toggle("running", news.running);
    document.body.dataset.frames = news.times.length;
    if (grown && !playing) await show(atEnd ? setup.times.length - 1 : frame);
    $("error").textContent = "";
  } catch (error) {
    $("error").textContent = `no answer from rockdda-post view: ${error.message}`;
  }
  setTimeout(follow, 1000);
}

guarded(async () => {
  offset = await unpack(setup.offset, Int32Array);
  start = await unpack(setup.start, Float32Array);
  next = Int32Array.from({ length: setup.vertices }, (_, v) => v + 1);
  owner = new Int32Array(setup.vertices);
  for (let i = 0; i < setup.blocks; i++) {
    next[offset[i + 1] - 1] = offset[i];
    owner.fill(i, offset[i], offset[i + 1]);
  }
  await source.open();
  field = setup.fields.find((f) => f.name === (FORMER[hash.get("field")] || hash.get("field"))) || field;
  connect();
  $("field").value = field.name;
  if (["N", "M", "Q"].includes(hash.get("liner"))) $("liner").value = hash.get("liner");
  if (hash.has("enlarge")) $("enlarge").value = hash.get("enlarge");
  const wish = Number(hash.get("pick"));
  if (Number.isInteger(wish) && wish >= 1 && wish <= setup.blocks) picked = wish - 1;
  if (hash.has("low") || hash.has("high")) {
    $("range").value = "typed";
    for (const name of ["low", "high"]) $(name).value = hash.get(name) || "";
  } else if (["usual", "all", "one"].includes(hash.get("range"))) $("range").value = hash.get("range");
  $("state").textContent = setup.state;
  $("state").classList.toggle("running", Boolean(setup.running));
  await show(hash.has("frame") ? Number(hash.get("frame")) : setup.live ? setup.times.length - 1 : 0);
  document.body.dataset.ready = "yes";
  document.body.dataset.blocks = setup.blocks;
  document.body.dataset.frames = setup.times.length;
  if (setup.live) setTimeout(follow, 1000);
  if (hash.has("play")) togglePlay();
});
