// The world in three dimensions, by WebGL.

const VERTEX = `
attribute vec3 place; attribute vec3 normal;
uniform mat4 camera; uniform mat4 model; uniform float lit;
varying float shade;
void main() {
  vec3 n = (model * vec4(normal, 0.0)).xyz;
  shade = mix(1.0, 0.6 + 0.42 * max(dot(n, vec3(0.35, -0.45, 0.82)), 0.0), lit);
  gl_Position = camera * model * vec4(place, 1.0);
}`;
const FRAGMENT = `
precision mediump float;
uniform vec4 colour; varying float shade;
void main() { gl_FragColor = vec4(colour.rgb * shade * colour.a, colour.a); }`;

const STILL = matrixOf(frameOfPose([0, 0, 0]));

/** A colour such as #1f6cb5 as four numbers, with an opacity. */
function rgba(hex, alpha = 1) {
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255).concat(alpha);
}

/** Whether two poses would be drawn over each other. */
function near(a, b, reach) {
  return b !== null && Math.hypot(a[0] - b[0], a[1] - b[1]) < 0.6 * reach;
}

/** Draws a world (see `readWorld`) with WebGL; `Painter.on` returns null where there is none. */
class Painter {
  static on(canvas, world) {
    const options = { antialias: true, stencil: true, preserveDrawingBuffer: true, premultipliedAlpha: true };
    const gl = canvas.getContext('webgl', options);
    return gl && new Painter(canvas, gl, world);
  }

  constructor(canvas, gl, world) {
    Object.assign(this, { canvas, gl, world });
    this.prepare();
    canvas.addEventListener('webglcontextlost', (e) => e.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => { this.prepare(); this.redraw?.(); });
  }

  /** Program and buffers. */
  prepare() {
    const { gl, world } = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    this.at = Object.fromEntries(['camera', 'model', 'lit', 'colour'].map((name) => [name, gl.getUniformLocation(program, name)]));
    this.place = gl.getAttribLocation(program, 'place');
    this.normal = gl.getAttribLocation(program, 'normal');
    gl.enableVertexAttribArray(this.place);
    const keep = (data, kind) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      const size = kind === gl.LINES ? 3 : 6;
      return { buffer, kind, size, count: data.length / size };
    };
    const faces = (data) => keep(data, gl.TRIANGLES), lines = (data) => keep(data, gl.LINES);
    const { floor } = world;
    const quad = [0, 1, 2, 0, 2, 3];
    const corners = [[floor.low[0], floor.low[1]], [floor.high[0], floor.low[1]], [floor.high[0], floor.high[1]], [floor.low[0], floor.high[1]]];
    this.mesh = {
      floor: faces(Float32Array.from(quad.flatMap((k) => [...corners[k], 0, 0, 0, 1]))),
      grid: lines(gridLines(floor.low, floor.high, floor.step)),
      boxes: world.boxes && faces(boxFaces(world.map, world.boxes)),
      creases: world.boxes && lines(boxCreases(world.map, world.boxes)),
      tint: world.tint && faces(floorTriangles(world.tint, 0.003)),
      way: world.way && faces(ribbon(world.way, world.unit * 0.0045, 0.006)),
      route: world.route && lines(dashes(world.route, world.unit * 0.012, 0.005)),
      zones: world.zones.map((zone) => lines(dashes(zone, world.unit * 0.012, 0.004))),
      rings: world.rings.map((ring) => lines(circle(ring.at, ring.radius, 0.008))),
      cell: world.cell && lines(Float32Array.from(frameLines(world.cell.min, world.cell.max))),
      shapes: world.robot.shapes.map((shape) => ({ faces: faces(shapeFaces(shape)), lines: lines(shapeLines(shape)), moved: shape.moved })),
    };
  }

  /** Draws a mesh, or `count` corners of it from `first` on. */
  put(mesh, colour, { model = STILL, lit = 0, first = 0, count = mesh ? mesh.count - first : 0 } = {}) {
    if (!mesh || count <= 0) return;
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffer);
    gl.vertexAttribPointer(this.place, 3, gl.FLOAT, false, 4 * mesh.size, 0);
    if (mesh.size === 6) {
      gl.enableVertexAttribArray(this.normal);
      gl.vertexAttribPointer(this.normal, 3, gl.FLOAT, false, 24, 12);
    } else {
      gl.disableVertexAttribArray(this.normal);
    }
    gl.uniformMatrix4fv(this.at.model, false, model);
    gl.uniform1f(this.at.lit, lit);
    gl.uniform4fv(this.at.colour, colour);
    gl.drawArrays(mesh.kind, first, count);
  }

  /** Draws so that no pixel is tinted twice: each pixel keeps the number of the last such drawing. At most 255 a picture. */
  once(draw) {
    const { gl } = this;
    this.drawn += 1;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.NOTEQUAL, this.drawn, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    gl.depthMask(false);
    draw();
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  /** The robot's shapes at frames. */
  robot(frames, palette, { opacity = 1, edges = 1, link = null } = {}) {
    this.mesh.shapes.forEach((shape, s) => {
      if (!frames[s]) return;
      const model = matrixOf(frames[s]);
      const hit = link !== null && this.world.robot.shapes[s].link === link;
      const hex = hit ? palette.alert : shape.moved ? palette.moved : palette.base;
      if (opacity > 0) this.put(shape.faces, rgba(hex, opacity), { model, lit: 1 });
      if (edges > 0) this.put(shape.lines, rgba(opacity < 0.5 ? hex : palette.edge, opacity < 0.5 ? edges : edges * this.crisp), { model });
    });
  }

  /** The whole picture. `now`: frames of the robot, or null, and the share of the way that is driven. */
  draw(camera, palette, now) {
    const { gl, mesh, world } = this;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...rgba(palette.stage));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    this.drawn = 0;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.uniformMatrix4fv(this.at.camera, false, camera.matrix());
    // Edges of a robot a few pixels wide would be all one sees of it.
    this.crisp = Math.min(1, (world.reach / camera.distance) * this.canvas.height / 40);

    gl.depthMask(false); // nothing lies below the floor, and what lies on it is drawn in order
    this.put(mesh.floor, rgba(palette.floor));
    this.put(mesh.grid, rgba(palette.grid));
    gl.depthMask(true);
    this.once(() => this.put(mesh.tint, rgba(palette.base, 0.13)));
    const driven = mesh.way ? 6 * Math.round((now.share * mesh.way.count) / 6) : 0;
    const way = (opacity) => {
      this.once(() => this.put(mesh.way, rgba(palette.ahead, opacity), { first: driven }));
      this.once(() => this.put(mesh.way, rgba(palette.driven, opacity), { count: driven }));
    };
    mesh.zones.forEach((zone) => this.put(zone, rgba(palette.moved)));
    this.put(mesh.route, rgba(palette.route));
    way(1);

    this.put(mesh.boxes, rgba(palette.obstacle), { lit: 1 });
    this.put(mesh.creases, rgba(palette.crease));
    // What obstacles hide shines through them.
    gl.depthFunc(gl.GREATER);
    way(0.3);
    if (now.frames) this.once(() => this.robot(now.frames, palette, { opacity: 0.4, edges: 0 }));
    for (const { solid, frames, link } of world.places) {
      if (solid) this.once(() => this.robot(frames, palette, { opacity: 0.4, edges: 0, link }));
    }
    gl.depthFunc(gl.LEQUAL);

    if (now.frames) this.robot(now.frames, palette);
    for (const { pose, frames } of world.ghosts) {
      if (near(pose, now.pose, world.reach)) continue;
      this.once(() => this.robot(frames, palette, { opacity: 0.1, edges: 0 }));
      this.robot(frames, palette, { opacity: 0, edges: 0.32 });
    }
    for (const place of world.places) {
      if (near(place.pose, now.pose, world.reach)) continue;
      if (place.solid) {
        this.robot(place.frames, palette, { link: place.link });
      } else {
        this.once(() => this.robot(place.frames, palette, { opacity: 0.16, edges: 0, link: place.link }));
        this.robot(place.frames, palette, { opacity: 0, edges: 0.9, link: place.link });
      }
    }
    gl.depthFunc(gl.ALWAYS);
    this.put(mesh.cell, rgba(palette.alert));
    mesh.rings.forEach((ring) => this.put(ring, rgba(palette.alert)));
    gl.depthFunc(gl.LEQUAL);
  }
}
