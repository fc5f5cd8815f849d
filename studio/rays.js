// Rays marched through a solid on the graphics card: a lattice in a region as it is, without a mesh.
"use strict";

// A ray starts on the region's surface, or on the section, and ends on the lattice. The solid's function is the core's: the cell on the
// torus, a sum of waves or a periodic texture; in each voxel phases and level that are linear; the region's signed distance, a texture.
const RAYS = `#version 300 es
precision highp float; precision highp int; precision highp sampler3D;
centroid in vec3 place; centroid in vec3 facing; centroid in float isCut; centroid in float amount;
uniform sampler3D torus; uniform sampler3D region; uniform sampler3D voxels;
uniform vec3 regionFirst; uniform vec3 regionStep; uniform vec3 voxelFirst; uniform vec3 voxelStep;
uniform vec3 low; uniform vec3 high; uniform vec4 plane; uniform bool onPlane; uniform bool depthOnly;
uniform int part; uniform float lipschitz; uniform float least; uniform float near; uniform bool metered; uniform mat3 metric;
uniform int waveCount; uniform vec4 waves[24]; uniform float shifts[24]; uniform bool straight; uniform vec4 only[4]; uniform vec2 levels; uniform float fractions[33];
out vec4 colour;
${SHADING}
float level, middle;
float distanceTo(vec3 p) {
  return texture(region, ((p - regionFirst) / regionStep + 0.5) / vec3(textureSize(region, 0))).r;
}
// At most 0 in the region, on this side of the section.
float outside(vec3 p) { return max(distanceTo(p), dot(plane.xyz, p) - plane.w); }
float core(vec3 p) {
  vec3 d = p - voxelFirst;
  vec4 u = only[0], a = only[1], b = only[2], c = only[3];
  if (!straight) {
    ivec3 shape = textureSize(voxels, 0) / ivec3(4, 1, 1);
    ivec3 at = clamp(ivec3(floor(d / voxelStep + 0.5)), ivec3(0), shape - 1);
    d -= voxelStep * vec3(at);
    u = texelFetch(voxels, ivec3(4 * at.x, at.yz), 0);
    a = texelFetch(voxels, ivec3(4 * at.x + 1, at.yz), 0);
    b = texelFetch(voxels, ivec3(4 * at.x + 2, at.yz), 0);
    c = texelFetch(voxels, ivec3(4 * at.x + 3, at.yz), 0);
  }
  level = u.w + dot(vec3(a.w, b.w, c.w), d);
  vec3 phase = u.xyz + vec3(dot(a.xyz, d), dot(b.xyz, d), dot(c.xyz, d));
  if (waveCount > 0) {
    float sum = 0.0;
    for (int i = 0; i < waveCount; i++) sum += waves[i].w * cos(6.283185307 * fract(dot(waves[i].xyz, phase) + shifts[i]));
    return sum;
  }
  float f = texture(torus, phase).r;
  if (!metered) return f;
  // The distance along the same normal under the Jacobian here (Distance::under).
  float h = 1.0 / float(textureSize(torus, 0).x);
  vec3 g = vec3(texture(torus, phase + vec3(h, 0, 0)).r - texture(torus, phase - vec3(h, 0, 0)).r,
                texture(torus, phase + vec3(0, h, 0)).r - texture(torus, phase - vec3(0, h, 0)).r,
                texture(torus, phase + vec3(0, 0, h)).r - texture(torus, phase - vec3(0, 0, h)).r) / (2.0 * h);
  float own = length(g * metric), here = length(a.xyz * g.x + b.xyz * g.y + c.xyz * g.z);
  return f * min((own * own * own + 1e-4) / (own * own * here + 1e-4), 8.0);
}
float field(vec3 p) {
  middle = core(p);
  return part == 0 ? abs(middle) - level : part == 1 ? middle - level : level - middle;
}
vec3 normalAt(vec3 p) {
  vec2 h = vec2(near, 0);
  float f = core(p);
  vec3 g = vec3(core(p + h.xyy), core(p + h.yxy), core(p + h.yyx)) - f;
  return normalize(part == 2 || (part == 0 && f < 0.0) ? -g : g);
}
vec3 regionNormal(vec3 p) {
  vec2 h = vec2(0.5 * regionStep.x, 0);
  return normalize(vec3(distanceTo(p + h.xyy) - distanceTo(p - h.xyy), distanceTo(p + h.yxy) - distanceTo(p - h.yxy),
                        distanceTo(p + h.yyx) - distanceTo(p - h.yyx)));
}
float fraction() {
  float t = clamp((level - levels.x) / max(levels.y - levels.x, 1e-9), 0.0, 1.0) * 32.0;
  int i = min(int(t), 31);
  return mix(fractions[i], fractions[i + 1], t - float(i));
}
// What colours say of a point where the core was asked last.
float amountAt(vec3 p) { return colours == 4 ? max(-distanceTo(p), 0.0) : fraction(); }
// Along a ray, between two distances of which one is in the region: where it begins or ends, on the inside.
float boundary(vec3 d, float inner, float outer) {
  for (int k = 0; k < 8; k++) {
    float mid = 0.5 * (inner + outer);
    if (outside(place + mid * d) > 0.0) outer = mid; else inner = mid;
  }
  return inner;
}
// Where the lattice begins between a distance outside it and one that is in it or, of a sheet, beyond its mid-surface.
float lattice(vec3 d, float lo, float hi) {
  float sign_ = sign(core(place + lo * d));
  for (int k = 0; k < 8; k++) {
    float mid = 0.5 * (lo + hi);
    if (field(place + mid * d) < 0.0 || (part == 0 && middle * sign_ < 0.0)) hi = mid; else lo = mid;
  }
  return hi;
}
vec4 met(vec3 p, bool cut) {
  vec3 n = cut ? regionNormal(p) : normalAt(p);
  core(p);
  return lit(n, cut ? 1.0 : 0.0, amountAt(p));
}
void main() {
  if (onPlane ? distanceTo(place) > 0.0 : dot(plane.xyz, place) > plane.w) discard;
  colour = vec4(0);
  if (depthOnly) return;
  float f = field(place);
  if (f < 0.0) { colour = onPlane ? hatched() : lit(normalize(facing), 1.0, amountAt(place)); return; }
  // Towards the eye is the third row of the camera.
  vec3 d = -vec3(turn[0].z, turn[1].z, turn[2].z);
  vec3 ends = (mix(low, high, greaterThan(d, vec3(0))) - place) / mix(d, vec3(1e-9), lessThan(abs(d), vec3(1e-9)));
  ends = mix(ends, vec3(1e30), lessThan(abs(d), vec3(1e-9)));
  float far = min(ends.x, min(ends.y, ends.z)), reached = 0.0, clear = 0.0, gap = 0.0;
  bool within = true;
  float was = middle;
  for (int i = 0; i < 800 && reached < far; i++) {
    float before = reached;
    // In the region about as far as the lattice is away; outside as far as the region is.
    reached = min(far, reached + max(within ? 1.4 * f / lipschitz : gap, least));
    vec3 p = place + reached * d;
    if (reached >= clear) {
      float off = outside(p);
      if (off > 0.0) {
        gap = 0.9 * off;
        if (!within) continue;
        // The lattice may end at the region's boundary that the ray has passed.
        float last = boundary(d, before, reached);
        if (field(place + last * d) < 0.0 || (part == 0 && was * middle < 0.0)) {
          colour = met(place + lattice(d, before, last) * d, false);
          return;
        }
        within = false;
        continue;
      }
      clear = reached - 0.9 * off;
    }
    f = field(p);
    bool passed = part == 0 && was * middle < 0.0;
    was = middle;
    if (!within) {
      // The region is entered again, maybe where it is solid.
      before = boundary(d, reached, before);
      if (field(place + before * d) < 0.0) { colour = met(place + before * d, true); return; }
      passed = part == 0 && was * middle < 0.0;
      within = true;
    }
    if (f < 0.0 || passed) { colour = met(place + lattice(d, before, reached) * d, false); return; }
  }
  discard;
}`;

// Draws solids by rays on `gl`. `take(head, body)` takes what the core gives; `painter` draws it for a camera.
function marcher(gl) {
  const shader = program(gl, VERTEX, RAYS);
  const uniform = (name) => gl.getUniformLocation(shader, name);
  const textures = {}, surface = gl.createVertexArray(), quad = gl.createVertexArray();
  const buffers = ["position", "normal", "index", "quad"].reduce((of, name) => ({ ...of, [name]: gl.createBuffer() }), {});
  let of = {}, count = 0, deepest = 0;
  const attribute = (name, width, type) => {
    const at = gl.getAttribLocation(shader, name);
    if (at < 0) return;
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, type, type === gl.SHORT, 0, 0);
  };
  gl.bindVertexArray(surface);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffers.position);
  attribute("position", 3, gl.FLOAT);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffers.normal);
  attribute("normal", 4, gl.SHORT);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.index);
  gl.bindVertexArray(quad);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffers.quad);
  attribute("position", 3, gl.FLOAT);
  gl.bindVertexArray(null);

  function texture(name, unit, shape, values, [inner, format], filter, wrap) {
    textures[name] ??= gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_3D, textures[name]);
    gl.texImage3D(gl.TEXTURE_3D, 0, inner, ...shape, 0, format, gl.FLOAT, values);
    for (const way of ["S", "T", "R"]) gl.texParameteri(gl.TEXTURE_3D, gl[`TEXTURE_WRAP_${way}`], wrap);
    for (const size of ["MIN", "MAG"]) gl.texParameteri(gl.TEXTURE_3D, gl[`TEXTURE_${size}_FILTER`], filter);
    gl.useProgram(shader);
    gl.uniform1i(uniform(name), unit);
  }

  function take(head, body) {
    let at = 0;
    const next = (type, n) => { const from = at; at += n * type.BYTES_PER_ELEMENT; return new type(body, from, n); };
    const volume = (shape) => shape[0] * shape[1] * shape[2];
    if (head.waves && !textures.torus) texture("torus", 0, [1, 1, 1], new Float32Array(1), [gl.R16F, gl.RED], gl.LINEAR, gl.REPEAT);
    if (head.cell) {
      const shape = [head.cell, head.cell, head.cell];
      texture("torus", 0, shape, next(Float32Array, volume(shape)), [gl.R16F, gl.RED], gl.LINEAR, gl.REPEAT);
    }
    const [nx, ny, nz] = head.voxels.shape, voxels = next(Float32Array, 16 * nx * ny * nz);
    texture("voxels", 1, [4 * nx, ny, nz], voxels, [gl.RGBA32F, gl.RGBA], gl.NEAREST, gl.CLAMP_TO_EDGE);
    if (head.region) {
      const shape = head.region.shape;
      const distances = next(Float32Array, volume(shape));
      texture("region", 2, shape, distances, [gl.R16F, gl.RED], gl.LINEAR, gl.CLAMP_TO_EDGE);
      deepest = -distances.reduce((least, d) => Math.min(least, d), 0);
      for (const [name, type, n] of [["position", Float32Array, 3 * head.vertices], ["normal", Int16Array, 4 * head.vertices]]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
        gl.bufferData(gl.ARRAY_BUFFER, next(type, n), gl.STATIC_DRAW);
      }
      gl.bindVertexArray(surface);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, next(Uint32Array, 3 * head.triangles), gl.STATIC_DRAW);
      gl.bindVertexArray(null);
      count = 3 * head.triangles;
    }
    of = { ...head, region: head.region || of.region, only: nx * ny * nz === 1 ? voxels : null };
  }

  function constants() {
    const { bounds: [low, high], region, voxels, fractions } = of;
    const all = { low, high, regionFirst: region.first, regionStep: region.step, voxelFirst: voxels.first, voxelStep: voxels.step };
    for (const [name, value] of Object.entries(all)) gl.uniform3fv(uniform(name), value);
    gl.uniform1i(uniform("part"), of.part);
    gl.uniform1f(uniform("lipschitz"), of.lipschitz);
    gl.uniform1f(uniform("least"), of.wavelength / 24);
    gl.uniform1f(uniform("near"), of.wavelength / 256);
    const waves = of.waves || [];
    gl.uniform1i(uniform("waveCount"), waves.length);
    if (waves.length) {
      gl.uniform4fv(uniform("waves"), waves.flatMap((w) => w.slice(0, 4)));
      gl.uniform1fv(uniform("shifts"), waves.map((w) => w[4]));
    }
    gl.uniform1i(uniform("straight"), of.only ? 1 : 0);
    gl.uniform4fv(uniform("only"), of.only || new Float32Array(16));
    gl.uniform1i(uniform("metered"), of.metric ? 1 : 0);
    // By columns; each row is the gradient of one phase.
    if (of.metric) gl.uniformMatrix3fv(uniform("metric"), false, [0, 1, 2].flatMap((c) => of.metric.map((row) => row[c])));
    gl.uniform2fv(uniform("levels"), fractions ? fractions.levels : [0, 1]);
    gl.uniform1fv(uniform("fractions"), fractions ? fractions.values : new Float32Array(33));
  }

  // The section's rectangle in the bounds, towards either side.
  function rectangle({ axis, plane }) {
    const [low, high] = of.bounds, b = (axis + 1) % 3, c = (axis + 2) % 3;
    const corner = (i, j) => { const p = [0, 0, 0]; p[axis] = plane[3] * plane[axis]; p[b] = [low, high][i][b]; p[c] = [low, high][j][c]; return p; };
    return new Float32Array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]].flatMap(([i, j]) => corner(i, j)));
  }

  function scene(camera, depthOnly) {
    gl.uniform1i(uniform("depthOnly"), depthOnly ? 1 : 0);
    gl.uniform1i(uniform("onPlane"), 0);
    gl.enable(gl.CULL_FACE);
    gl.bindVertexArray(surface);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    gl.disable(gl.CULL_FACE);
    // The side of the section that is left lies behind it.
    if (camera.axis >= 0 && camera.plane[camera.axis] * camera.rows[2][camera.axis] > 0) {
      gl.uniform1i(uniform("onPlane"), 1);
      gl.bindVertexArray(quad);
      gl.drawArrays(gl.TRIANGLES, 0, 6);
    }
    gl.bindVertexArray(null);
  }

  // What lies in front is found first: one ray a pixel is marched.
  function march(camera) {
    aim(gl, shader, camera);
    constants();
    if (camera.axis >= 0) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers.quad);
      gl.bufferData(gl.ARRAY_BUFFER, rectangle(camera), gl.DYNAMIC_DRAW);
    }
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.depthFunc(gl.LESS);
    gl.colorMask(false, false, false, false);
    scene(camera, true);
    gl.colorMask(true, true, true, true);
    gl.depthFunc(gl.EQUAL);
    scene(camera, false);
    gl.depthFunc(gl.LESS);
    // Waits for the card.
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  // A picture of a share of the pixels, enlarged.
  const target = gl.createFramebuffer(), depth = gl.createRenderbuffer(), shown = program(gl, `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1), 0, 1); }`, `#version 300 es
    precision highp float; uniform sampler2D picture; uniform vec2 size; out vec4 colour;
    void main() { colour = texture(picture, gl_FragCoord.xy / size); }`);
  const picture = gl.createTexture(), none = gl.createVertexArray();
  function coarse(camera, width, height, share) {
    const [w, h] = [width, height].map((n) => Math.max(1, Math.round(n * share)));
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, picture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, w, h, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    for (const size of ["MIN", "MAG"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${size}_FILTER`], gl.LINEAR);
    for (const way of ["S", "T"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_WRAP_${way}`], gl.CLAMP_TO_EDGE);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, picture, 0);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, w, h);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    gl.viewport(0, 0, w, h);
    march(camera);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.useProgram(shown);
    gl.uniform1i(gl.getUniformLocation(shown, "picture"), 3);
    gl.uniform2f(gl.getUniformLocation(shown, "size"), width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(none);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
    gl.enable(gl.DEPTH_TEST);
  }

  // The whole picture in tiles, one after the other as long as nothing moves.
  function* tiles(camera, width, height) {
    const side = Math.max(32, Math.round(painter.share * Math.sqrt(width * height)));
    for (let y = 0; y < height; y += side) {
      for (let x = 0; x < width; x += side) {
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(x, y, side, side);
        march(camera);
        gl.disable(gl.SCISSOR_TEST);
        yield;
      }
    }
  }

  // While something moves a picture has so many pixels that there are 30 in a second, 8 without a card; at rest it has all.
  const wanted = drawnBySoftware() ? 120 : 28;
  function painter(camera) {
    const { width, height } = gl.canvas, start = performance.now();
    painter.stop();
    gl.viewport(0, 0, width, height);
    if (painter.share === 1) march(camera);
    else coarse(camera, width, height, painter.share);
    painter.ms = performance.now() - start;
    painter.whole = painter.share === 1;
    const left = painter.whole ? null : tiles(camera, width, height);
    painter.share = Math.max(0.1, Math.min(1, painter.share * Math.sqrt(wanted / Math.max(painter.ms, 1))));
    if (!left) return;
    let waiting = 0;
    const next = () => {
      painter.whole = left.next().done;
      if (!painter.whole) waiting = requestAnimationFrame(next);
    };
    const still = setTimeout(next, 200);
    painter.stop = () => { clearTimeout(still); cancelAnimationFrame(waiting); left.return(); };
    painter.finish = () => { for (const _ of left); painter.stop(); painter.whole = true; };
  }
  painter.share = wanted > 28 ? 0.2 : 1;
  painter.stop = painter.finish = () => {};
  return { take, painter, deepest: () => deepest };
}
