// Drawing in WebGL 2: one program for everything that is seen, and the sun's depth map for shadows.
const SURFACE = 0, FLAT = 1, GROUND = 2, HANDLE = 3;
const SHADOW_SIZE = 2048;

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
uniform mat4 model, view, light;
uniform mat3 turned;
out vec3 at, n;
out vec4 lit;
void main() {
  vec4 p = model * vec4(place, 1.);
  at = p.xyz;
  n = turned * normal;
  lit = light * p;
  gl_Position = view * p;
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
in vec3 at, n;
in vec4 lit;
out vec4 colour;
uniform vec4 paint;
uniform vec3 eye, sun, sky, soil, middle;
uniform float gloss, radius, shade;
uniform int kind;
uniform bool soft;
uniform sampler2DShadow depths;

float sunlight() {
  vec3 p = lit.xyz / lit.w * .5 + .5;
  if (p.x < 0. || p.x > 1. || p.y < 0. || p.y > 1.) return 1.;
  float z = p.z - .0025;
  if (!soft) return texture(depths, vec3(p.xy, z));
  float sum = 0.;
  for (int i = -2; i <= 2; i++)
    for (int j = -2; j <= 2; j++) sum += texture(depths, vec3(p.xy + vec2(i, j) * .0011, z));
  return sum / 25.;
}

void surface() {
  vec3 normal = normalize(n), seen = normalize(eye - at);
  if (dot(normal, seen) < 0.) normal = -normal;
  float light = sunlight(), facing = max(dot(normal, sun), 0.) * light;
  float shine = pow(max(dot(normal, normalize(sun + seen)), 0.), 56.) * gloss * light;
  float rim = pow(1. - max(dot(normal, seen), 0.), 3.);
  vec3 around = mix(soil, sky, .5 + .5 * normal.z);
  colour = vec4(paint.rgb * (around + .62 * facing) + shine + .1 * rim * sky, paint.a);
}

void ground() {
  float fade = smoothstep(1., .2, length(at.xy - middle.xy) / radius), dark = 1. - sunlight();
  vec2 cell = at.xy * 5. / radius, line = abs(fract(cell - .5) - .5) / fwidth(cell);
  float grid = 1. - min(min(line.x, line.y), 1.);
  colour = vec4(mix(vec3(0.), paint.rgb, grid * (1. - dark)), fade * max(grid * paint.a, dark * shade));
}

void main() {
  if (kind == ${FLAT}) colour = paint;
  else if (kind == ${GROUND}) ground();
  else surface();
  if (kind == ${HANDLE} && dot(at - middle, eye - middle) < -.001) colour.a *= .22;
}`;

class Canvas {
  constructor(element) {
    const gl = element.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
    if (!gl) throw Error("no WebGL 2");
    this.element = element;
    this.gl = gl;
    this.program = this.linked(VERTEX, FRAGMENT);
    gl.useProgram(this.program);
    this.places = new Map();
    this.meshes = new Map();
    this.depths = this.texture(gl.DEPTH_COMPONENT24, SHADOW_SIZE, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    this.shadows = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depths, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.uniform1i(this.at("depths"), 0);
  }

  linked(...texts) {
    const { gl } = this;
    const program = gl.createProgram();
    const shaders = texts.map((text, k) => {
      const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      return shader;
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS))
      throw Error(gl.getProgramInfoLog(program) + shaders.map((shader) => gl.getShaderInfoLog(shader)).join(""));
    return program;
  }

  at(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name);
  }

  texture(inner, size, format, type, data) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, size, size, 0, format, type, data);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
      gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    return texture;
  }

  /** The array of a mesh on the graphics chip, and its number of corners. */
  mesh(data) {
    const { gl, meshes } = this;
    if (!meshes.has(data)) {
      const [array, buffer] = [gl.createVertexArray(), gl.createBuffer()];
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.STATIC_DRAW);
      for (const k of [0, 1]) {
        gl.enableVertexAttribArray(k);
        gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
      }
      meshes.set(data, [array, data.length / 6, buffer]);
    }
    return meshes.get(data);
  }

  /** Free the memory of a mesh that is drawn no more. */
  forget(data) {
    const [array, , buffer] = this.meshes.get(data) ?? [];
    if (!array) return;
    this.gl.deleteVertexArray(array);
    this.gl.deleteBuffer(buffer);
    this.meshes.delete(data);
  }

  draw({ mesh, model, paint, kind = SURFACE, gloss = 0.25 }, as = kind) {
    const { gl } = this;
    const [array, corners] = this.mesh(mesh);
    const turnedColumns = [0, 1, 2].flatMap((k) => {
      const column = columnOf(model, k);
      return scaled(column, 1 / (dot(column, column) || 1));
    });
    gl.bindVertexArray(array);
    gl.uniformMatrix4fv(this.at("model"), true, model);
    gl.uniformMatrix3fv(this.at("turned"), false, turnedColumns);
    gl.uniform4fv(this.at("paint"), paint);
    gl.uniform1i(this.at("kind"), as);
    gl.uniform1f(this.at("gloss"), gloss);
    gl.drawArrays(gl.TRIANGLES, 0, corners);
  }

  /** Solids, which cast shadows; then what is clear; last the handles, over everything. */
  render({ solids, clear, ground, handles, handle, camera, centre, radius, light, isSoft }) {
    const { gl, element } = this;
    const sun = unit([0.42, -0.5, 1.05]);
    const far = plus(centre, scaled(sun, 3 * radius));
    const seen = product(parallel(1.25 * radius, 0.1 * radius, 6 * radius), lookingAt(far, centre, AXES[1]));
    gl.uniformMatrix4fv(this.at("light"), true, seen);
    for (const [name, value] of Object.entries({ sun, eye: camera.eye, sky: light.sky, soil: light.soil, middle: centre }))
      gl.uniform3fv(this.at(name), value);
    gl.uniform1f(this.at("shade"), light.shade);
    gl.uniform1f(this.at("radius"), 2.4 * radius);
    gl.uniform1i(this.at("soft"), isSoft);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.at("view"), true, seen);
    for (const each of solids) this.draw(each, FLAT);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, this.depths);
    gl.viewport(0, 0, element.width, element.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.at("view"), true, camera.matrix);
    for (const each of solids) this.draw(each);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const each of [ground, ...clear]) this.draw(each);
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.uniform3fv(this.at("middle"), handle);
    for (const each of handles) this.draw(each);
  }
}
