// A small still picture of a tool: its mesh.glb drawn on a 2D canvas, without WebGL and without a 3D session.
//
//   drawTool(canvas, toolId, { sequence: [4, 1, ...] })      coloured by the order of work, tints where there is none
//   drawTool(canvas, toolId, { marked: [3, 5] })             these regions in the signal colour, the rest grey
//
// The canvas takes the size of its box. Meshes are kept by tool id; the colours follow the theme.

import { mix, rampColour, tint } from "./ramp.js";

const MOST_TRIANGLES = 60000;
const AZIMUTH = -0.46;
const ELEVATION = 0.74;
const LIGHT = unit([-0.45, -0.6, 1.15]);
const kept = new Map();

function unit(v) {
  const length = Math.hypot(...v) || 1;
  return v.map((value) => value / length);
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// GLB 2.0: a header of 12 bytes, a JSON chunk, a binary chunk.
function parts(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  const start = 20 + length + 8;
  const read = (index) => {
    const accessor = json.accessors[index];
    const slice = json.bufferViews[accessor.bufferView];
    const at = start + (slice.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
    const Type = { 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array }[accessor.componentType];
    return new Type(buffer.slice(at, at + accessor.count * (accessor.type === "VEC3" ? 3 : 1) * Type.BYTES_PER_ELEMENT));
  };
  return json.nodes.filter((node) => node.mesh !== undefined).map((node) => {
    const primitive = json.meshes[node.mesh].primitives[0];
    const named = /^region_(\d+)$/.exec(node.name ?? "");
    return { region: named ? Number(named[1]) : -1, points: read(primitive.attributes.POSITION), faces: read(primitive.indices) };
  });
}

function triangles(groups) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const { points } of groups) for (let i = 0; i < points.length; i += 1) {
    low[i % 3] = Math.min(low[i % 3], points[i]);
    high[i % 3] = Math.max(high[i % 3], points[i]);
  }
  const middle = low.map((value, axis) => (value + high[axis]) / 2);
  const scale = 2 / Math.max(1e-9, ...high.map((value, axis) => value - low[axis]));
  const list = [];
  for (const { region, points, faces } of groups) for (let i = 0; i < faces.length; i += 3) {
    const corners = [0, 1, 2].map((k) => [0, 1, 2].map((axis) => (points[3 * faces[i + k] + axis] - middle[axis]) * scale));
    const [a, b, c] = corners;
    list.push({ region, corners, normal: unit(cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]])) });
  }
  return list;
}

async function read(toolId) {
  const response = await fetch(`/api/v1/tools/${encodeURIComponent(toolId)}/mesh.glb`);
  if (!response.ok) return [];
  const groups = parts(await response.arrayBuffer());
  return groups.reduce((sum, group) => sum + group.faces.length / 3, 0) > MOST_TRIANGLES ? [] : triangles(groups);
}

function shade(colour, lit, memory) {
  const step = Math.round(Math.min(1, Math.max(0, lit)) * 10);
  const key = `${colour}:${step}`;
  if (!memory.has(key)) memory.set(key, mix("#000000", colour, 0.74 + 0.026 * step));
  return memory.get(key);
}

function paint(canvas, list, colourOf) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  const right = [Math.cos(AZIMUTH), Math.sin(AZIMUTH), 0];
  const back = [Math.sin(AZIMUTH) * Math.cos(ELEVATION), -Math.cos(AZIMUTH) * Math.cos(ELEVATION), Math.sin(ELEVATION)];
  const up = cross(back, right);
  const flat = list.map(({ region, corners, normal }) => ({ region, lit: Math.abs(dot(normal, LIGHT)), facing: dot(normal, back), depth: corners.reduce((sum, p) => sum + dot(p, back), 0), xy: corners.map((p) => [dot(p, right), dot(p, up)]) }));
  const reach = [0, 1].map((axis) => Math.max(1e-9, ...flat.map(({ xy }) => Math.max(...xy.map((p) => Math.abs(p[axis]))))));
  const scale = Math.min(width / 2 / reach[0], height / 2 / reach[1]) * 0.88;
  const memory = new Map();
  pen.lineWidth = 0.6;
  pen.lineJoin = "round";
  for (const { region, lit, xy } of flat.filter((face) => face.region >= 0 || face.facing > 0).sort((a, b) => a.depth - b.depth)) {
    pen.fillStyle = pen.strokeStyle = shade(colourOf(region), lit, memory);
    pen.beginPath();
    xy.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](width / 2 + x * scale, height / 2 - y * scale));
    pen.closePath();
    pen.fill();
    pen.stroke();
  }
}

export async function drawTool(canvas, toolId, { sequence = null, marked = null, key = toolId } = {}) {
  if (!kept.has(key)) kept.set(key, read(toolId));
  const list = await kept.get(key);
  const draw = () => {
    if (!canvas.isConnected || !list.length) return;
    const body = css("--scene-body");
    const signal = css("--signal");
    const order = new Map((sequence ?? []).map((region, index) => [region, rampColour(index, sequence.length)]));
    const plain = (region) => (marked ? (marked.includes(region) ? signal : mix(body, css("--surface"), 0.35)) : order.get(region) ?? tint(region));
    paint(canvas, list, (region) => (region < 0 ? body : plain(region)));
  };
  draw();
  addEventListener("themechange", draw);
}
