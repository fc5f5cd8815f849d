// A viewer of closed meshes, without any library: turn, move, zoom; a section plane; colours.
// A page has <figure class="viewer"> with a canvas; one that is of a single mesh has <script type="application/octet-stream"> of it:
// the DEFLATE stream, in base64, of a header of JSON, a line feed, and arrays (see viewer.py). A notebook's widget is handed the stream.
"use strict";

const CREASE = Math.cos((35 * Math.PI) / 180);
// What stands for no value at a corner: no number of the shaders' is larger.
const MISSING = 1e38;

const VERTEX = `#version 300 es
in vec3 position; in vec4 normal; in float value;
uniform mat3 turn; uniform vec3 middle; uniform vec2 shift; uniform vec2 zoom; uniform float depth;
centroid out vec3 place; centroid out vec3 facing; centroid out float isCut; centroid out float amount;
void main() {
  vec3 seen = turn * (position - middle);
  place = position; facing = normal.xyz; isCut = normal.w; amount = value;
  gl_Position = vec4((seen.xy + shift) * zoom, -seen.z * depth, 1.0);
}`;

// Colours by normal, the light, and the section's own face.
const SHADING = `
uniform mat3 turn; uniform int colours; uniform float steep; uniform vec2 span;
vec3 scale(float t) {
  // Viridis by its polynomial (M. Zucker).
  t = clamp(t, 0.0, 1.0);
  vec3 c0 = vec3(0.27773, 0.00541, 0.33410), c1 = vec3(0.10509, 1.40461, 1.38459), c2 = vec3(-0.33086, 0.21485, 0.09510);
  vec3 c3 = vec3(-4.63423, -5.79910, -19.33244), c4 = vec3(6.22827, 14.17993, 56.69055), c5 = vec3(4.77638, -13.74515, -65.35303);
  vec3 c6 = vec3(-5.43546, 4.64585, 26.31244);
  return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6)))));
}
// Flat and hatched.
vec4 hatched() {
  float line = step(0.78, fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0));
  return vec4(mix(vec3(0.80, 0.36, 0.24), vec3(0.62, 0.25, 0.16), line), 1.0);
}
vec4 lit(vec3 n, float isCut, float amount) {
  vec3 seen = turn * n;
  vec3 base = mix(vec3(0.72, 0.76, 0.80), vec3(0.93, 0.80, 0.58), isCut);
  if (colours == 1) base = -n.z > steep ? vec3(0.86, 0.28, 0.22) : vec3(0.74, 0.77, 0.80);
  if (colours >= 2) base = amount > 1e37 ? vec3(0.667) : scale((amount - span.x) / max(span.y - span.x, 1e-12));
  float key = max(dot(seen, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
  float fill = max(dot(seen, normalize(vec3(0.8, -0.2, 0.5))), 0.0);
  return vec4(base * (0.30 + 0.62 * key + 0.18 * fill), 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
// At a pixel's centre beyond its triangle the place could lie on the other side of the section.
centroid in vec3 place; centroid in vec3 facing; centroid in float isCut; centroid in float amount;
uniform vec4 plane;
out vec4 colour;
${SHADING}
void main() {
  if (dot(plane.xyz, place) > plane.w) discard;
  // The inside of the solid, seen through the section, is where the section cuts it.
  colour = gl_FrontFacing ? lit(normalize(facing), isCut, amount) : hatched();
}`;

async function unpacked(raw) {
  const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const end = bytes.indexOf(10);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  let at = end + 1;
  const take = (type, count) => {
    const part = bytes.slice(at, at + count * type.BYTES_PER_ELEMENT);
    at += part.length;
    return new type(part.buffer);
  };
  const whole = take(Uint16Array, 3 * head.vertices);
  const vertices = new Float32Array(whole.length);
  for (let i = 0; i < whole.length; i++) {
    const a = i % 3;
    vertices[i] = head.min[a] + (whole[i] / 65535) * (head.max[a] - head.min[a]);
  }
  const triangles = take(Uint32Array, 3 * head.triangles);
  const cut = take(Uint8Array, head.triangles);
  const values = head.span ? take(Uint16Array, head.vertices) : null;
  const missing = head.missing ? take(Uint8Array, head.vertices) : null;
  return { head, vertices, triangles, cut, values, missing };
}

// Arrays by corner: the position; the normal, and whether the triangle is cut, as 16-bit numbers; the value. Normals are the mean of those of the triangles round a vertex that lie within 35° of the corner's own.
function corners({ head, vertices, triangles, cut, values, missing }) {
  const count = head.triangles;
  const normals = new Float32Array(3 * count);
  const first = new Uint32Array(head.vertices + 1);
  for (const v of triangles) first[v + 1]++;
  for (let v = 0; v < head.vertices; v++) first[v + 1] += first[v];
  const round = new Uint32Array(3 * count), next = first.slice();
  for (let t = 0; t < count; t++) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[3 * t + k]);
    const p = [0, 1, 2].map((i) => vertices[b + i] - vertices[a + i]);
    const q = [0, 1, 2].map((i) => vertices[c + i] - vertices[a + i]);
    normals.set([p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]], 3 * t);
    for (let k = 0; k < 3; k++) round[next[triangles[3 * t + k]]++] = t;
  }
  const length = (t) => Math.hypot(normals[3 * t], normals[3 * t + 1], normals[3 * t + 2]) || 1e-30;
  const lengths = Float32Array.from({ length: count }, (_, t) => length(t));
  const of = { position: new Float32Array(9 * count), normal: new Int16Array(12 * count), value: new Float32Array(values ? 3 * count : 0) };
  for (let t = 0; t < count; t++) {
    const isMissing = missing && [0, 1, 2].some((k) => missing[triangles[3 * t + k]]);
    for (let k = 0; k < 3; k++) {
      const v = triangles[3 * t + k], at = 3 * t + k;
      const sum = [0, 0, 0];
      for (let i = first[v]; i < first[v + 1]; i++) {
        const s = round[i];
        const along = normals[3 * t] * normals[3 * s] + normals[3 * t + 1] * normals[3 * s + 1] + normals[3 * t + 2] * normals[3 * s + 2];
        if (along >= CREASE * lengths[t] * lengths[s]) for (let i = 0; i < 3; i++) sum[i] += normals[3 * s + i];
      }
      of.position.set(vertices.subarray(3 * v, 3 * v + 3), 3 * at);
      const one = 32767 / (Math.hypot(...sum) || 1);
      of.normal.set([one * sum[0], one * sum[1], one * sum[2], cut[t] ? 32767 : 0], 4 * at);
      if (values) of.value[at] = isMissing ? MISSING : head.span[0] + (values[v] / 65535) * (head.span[1] - head.span[0]);
    }
  }
  return of;
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

// Where a camera's rays fall: the uniforms of VERTEX and SHADING.
function aim(gl, shader, camera) {
  const uniform = (name) => gl.getUniformLocation(shader, name);
  gl.useProgram(shader);
  gl.uniformMatrix3fv(uniform("turn"), false, [0, 1, 2].flatMap((c) => camera.rows.map((r) => r[c])));
  for (const name of ["middle", "shift", "zoom", "plane", "span"]) gl[`uniform${camera[name].length}fv`](uniform(name), camera[name]);
  for (const name of ["depth", "steep"]) gl.uniform1f(uniform(name), camera[name]);
  gl.uniform1i(uniform("colours"), camera.colours);
}

// A round length of about a fifth of the width for the scale bar: 1, 2 or 5 times a power of ten.
function roundLength(of) {
  const power = 10 ** Math.floor(Math.log10(of));
  return [5, 2, 1].map((m) => m * power).find((v) => v <= of);
}

// Whether the processor draws: smoothing edges then takes as long as all else.
let bySoftware;
function drawnBySoftware() {
  if (bySoftware === undefined) {
    const gl = document.createElement("canvas").getContext("webgl2");
    const known = gl && gl.getExtension("WEBGL_debug_renderer_info");
    bySoftware = !!known && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(known.UNMASKED_RENDERER_WEBGL));
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
  }
  return bySoftware;
}

// Colours by number, as Python names them.
const COLOURS = ["faces", "overhang", "values", "fraction", "depth"];

// A viewer in a figure; null where the browser cannot draw. `show(head, of)` shows a mesh by its bounds, span of values and arrays: of each
// corner, or of vertices with an `index`. The camera and the section stay where they are. `seen()` is what the user sees, by names and
// units of Python's View; `look(wanted)` changes some of it; the figure has an event "look" when the user has. `paint(head, painter)`
// leaves the drawing to a function of the camera, which draws what lies in the bounds of `head` on `gl` until its `stop()`; its `spans` are those
// of colours by their names.
function viewer(figure) {
  const canvas = figure.querySelector("canvas");
  const gl = canvas.getContext("webgl2", { antialias: !drawnBySoftware(), alpha: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const shader = program(gl, VERTEX, FRAGMENT), buffers = {}, indices = gl.createBuffer();
  let head = { min: [0, 0, 0], max: [1, 1, 1], span: null }, count = 0, indexed = false, size = 1, middle = [0, 0, 0], painter = null;
  for (const [name, width, type] of [["position", 3, gl.FLOAT], ["normal", 4, gl.SHORT], ["value", 1, gl.FLOAT]]) {
    const at = gl.getAttribLocation(shader, name);
    buffers[name] = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, type, type === gl.SHORT, 0, 0);
  }
  const home = { azimuth: 30, elevation: 25, zoom: 1, shift: [0, 0] };
  const state = { ...home, axis: "", share: 0.5, flip: false, colours: +figure.querySelector("[name=colours]").value, steep: 45 };

  function frame(shown) {
    painter?.stop();
    head = shown;
    size = Math.hypot(...[0, 1, 2].map((a) => head.max[a] - head.min[a])) || 1;
    middle = [0, 1, 2].map((a) => 0.5 * (head.min[a] + head.max[a]));
  }

  function paint(shown, by) {
    frame(shown);
    painter = by;
    draw();
  }

  function show(shown, of) {
    frame(shown);
    painter = null;
    indexed = !!of.index;
    count = indexed ? of.index.length : of.position.length / 3;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    if (indexed) gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, of.index, gl.DYNAMIC_DRAW);
    for (const name in buffers) {
      const data = of[name] && of[name].length ? of[name] : null;
      const at = gl.getAttribLocation(shader, name);
      if (data) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
        gl.enableVertexAttribArray(at);
      } else gl.disableVertexAttribArray(at);
    }
    draw();
    figure.dataset.drawn = count / 3;
  }

  // Rows: to the right, up, and towards the eye; azimuth about z, elevation above xy, as in `trabecula render`.
  const turn = () => {
    const [a, e] = [state.azimuth, state.elevation].map((v) => (v * Math.PI) / 180);
    const [ca, sa, ce, se] = [Math.cos(a), Math.sin(a), Math.cos(e), Math.sin(e)];
    return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
  };
  const reach = () => (0.5 * size) / state.zoom;

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const rows = turn(), side = Math.min(width, height);
    const plane = [0, 0, 0, 1e30];
    const a = state.axis ? "xyz".indexOf(state.axis) : -1;
    if (state.axis) {
      const at = head.min[a] + state.share * (head.max[a] - head.min[a]);
      plane[a] = state.flip ? -1 : 1;
      plane[3] = state.flip ? -at : at;
    }
    const camera = {
      rows, middle, plane, shift: state.shift, zoom: [side / width / reach(), side / height / reach()], depth: 1 / size,
      colours: state.colours, steep: Math.cos((state.steep * Math.PI) / 180), span: head.spans?.[COLOURS[state.colours]] || head.span || [0, 1], axis: a,
    };
    if (painter) {
      painter(camera);
      return marks(rows, (2 * reach()) / side, a);
    }
    aim(gl, shader, camera);
    if (indexed) gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    else gl.drawArrays(gl.TRIANGLES, 0, count);
    marks(rows, (2 * reach()) / side, a);
  }

  const part = (name) => figure.querySelector(`[data-part=${name}]`);
  function marks(rows, mm, a) {
    const length = roundLength(0.2 * canvas.clientWidth * mm);
    part("bar").style.width = `${length / mm}px`;
    part("length").textContent = `${+length.toPrecision(1)} mm`;
    rows[0].forEach((_, k) => {
      const [x, y] = [22 * rows[0][k], -22 * rows[1][k]];
      const line = part("xyz"[k]);
      line.querySelector("line").setAttribute("x2", x);
      line.querySelector("line").setAttribute("y2", y);
      line.querySelector("text").setAttribute("x", 1.35 * x);
      line.querySelector("text").setAttribute("y", 1.35 * y);
    });
    part("at").textContent = a < 0 ? "" : `${state.axis} = ${position().toPrecision(4)} mm`;
  }

  let waiting = false, touched = false;
  const later = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      draw();
      if (touched) figure.dispatchEvent(new Event("look"));
      touched = false;
    });
  };
  const redraw = () => { touched = true; later(); };

  const position = () => { const a = "xyz".indexOf(state.axis); return head.min[a] + state.share * (head.max[a] - head.min[a]); };
  const seen = () => ({
    section: state.axis ? `${state.axis}${state.flip ? ">" : "<"}${+position().toPrecision(7)}` : "",
    azimuth: state.azimuth, elevation: state.elevation, zoom: state.zoom, color: COLOURS[state.colours], overhang: state.steep,
  });
  function look(wanted) {
    const section = /^([xyz])([<>])(.+)$/.exec(wanted.section || "");
    if (section) {
      const a = "xyz".indexOf(section[1]);
      Object.assign(state, { axis: section[1], flip: section[2] === ">" });
      state.share = Math.max(0, Math.min(1, (section[3] - head.min[a]) / (head.max[a] - head.min[a]) || 0));
    } else if ("section" in wanted) state.axis = "";
    for (const key of ["azimuth", "elevation", "zoom"]) if (key in wanted) state[key] = wanted[key];
    if ("overhang" in wanted) state.steep = wanted.overhang;
    if (COLOURS.includes(wanted.color)) state.colours = COLOURS.indexOf(wanted.color);
    const control = (name) => figure.querySelector(`[name=${name}]`);
    control("axis").value = state.axis;
    control("share").value = state.share;
    control("flip").checked = state.flip;
    control("colours").value = state.colours;
    control("steep").value = state.steep;
    toggled();
    later();
  }
  const toggled = () => {
    part("share").disabled = !state.axis;
    part("steep").hidden = state.colours !== 1;
    part("legend").hidden = state.colours < 2;
    part("angle").textContent = `${state.steep}°`;
  };
  const tilt = (right, up) => {
    state.azimuth -= right;
    state.elevation = Math.max(-90, Math.min(90, state.elevation + up));
    redraw();
  };
  const move = (x, y) => {
    const mm = (2 * reach()) / Math.min(canvas.clientWidth, canvas.clientHeight);
    state.shift = [state.shift[0] + x * mm, state.shift[1] - y * mm];
    redraw();
  };
  const nearer = (by) => { state.zoom = Math.max(0.2, Math.min(200, state.zoom * by)); redraw(); };

  const fingers = new Map();
  const apart = () => { const [p, q] = [...fingers.values()]; return Math.hypot(p[0] - q[0], p[1] - q[1]); };
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); });
  canvas.addEventListener("pointermove", (e) => {
    const old = fingers.get(e.pointerId);
    if (!old) return;
    const before = fingers.size === 2 ? apart() : 0;
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    const [x, y] = [e.clientX - old[0], e.clientY - old[1]];
    if (fingers.size === 2) { nearer(apart() / before); move(x / 2, y / 2); }
    else if (e.shiftKey || e.buttons === 4 || e.buttons === 2) move(x, y);
    else tilt(0.4 * x, 0.4 * y);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); nearer(Math.exp(-0.0015 * e.deltaY)); }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const done = {
      ArrowLeft: () => tilt(-10, 0), ArrowRight: () => tilt(10, 0), ArrowUp: () => tilt(0, 10), ArrowDown: () => tilt(0, -10),
      "+": () => nearer(1.2), "=": () => nearer(1.2), "-": () => nearer(1 / 1.2),
      Home: () => { Object.assign(state, home, { shift: [0, 0] }); redraw(); },
    }[e.key];
    if (done) { e.preventDefault(); done(); }
  });
  figure.addEventListener("input", (e) => {
    const { name, value } = e.target;
    if (name === "axis") state.axis = value;
    if (name === "share") state.share = +value;
    if (name === "flip") state.flip = e.target.checked;
    if (name === "colours") state.colours = +value;
    if (name === "steep") state.steep = +value;
    toggled();
    redraw();
  });
  const resized = new ResizeObserver(later);
  resized.observe(canvas);
  figure.classList.add("live");
  // Browsers keep few contexts; one that is not needed any more is given back.
  const close = () => { resized.disconnect(); gl.getExtension("WEBGL_lose_context")?.loseContext(); };
  return { gl, show, paint, draw, seen, look, close };
}

// Shows the mesh of a stream in a figure; the viewer, or null where the browser cannot draw and a still picture stands for it.
async function view(figure, stream) {
  try {
    const it = "DecompressionStream" in window ? viewer(figure) : null;
    if (!it) throw new Error("this browser has no WebGL 2, or cannot unpack the mesh");
    const mesh = await unpacked(stream);
    it.show(mesh.head, corners(mesh));
    return it;
  } catch (error) {
    console.error(error);
    figure.classList.add("still");
    return null;
  }
}

async function viewAll() {
  for (const figure of document.querySelectorAll("figure.viewer")) {
    const given = figure.querySelector("script");
    if (!given) continue;
    const it = await view(figure, Uint8Array.from(atob(given.textContent.trim()), (c) => c.charCodeAt(0)));
    if (it && given.dataset.look) it.look(JSON.parse(given.dataset.look));
  }
}
