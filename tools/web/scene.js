// The way of the object in the camera's frame, in three dimensions: the paper's Figure 11. three.js draws it; lines are
// its wide ones, since a screen's own are a hair thin.
'use strict';
(function (berth) {
  const kMost = 4000;          // points of the way
  const kTurn = 0.12, kZoom = 1.18;

  /// The camera's frame (x right, y down, z forward) as three.js has it (y up, z towards the viewer).
  const place = (p) => new THREE.Vector3(p[0], -p[1], -p[2]);

  /// Rows of R = Rz · Ry · Rx, degrees.
  function rotation(value) {
    const [a, b, c] = [value[3], value[4], value[5]].map((d) => d * Math.PI / 180);
    const [ca, sa, cb, sb, cc, sc] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b), Math.cos(c), Math.sin(c)];
    return [
      [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
      [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
      [-sb, cb * sa, cb * ca],
    ];
  }
  const moved = (value, p) => rotation(value).map((row, i) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + value[i]);

  class Scene {
    constructor(parent, buttons) {
      this.parent = parent;
      this.way = [];
      this.view = 'orbit';
      this.turn = {around: -0.95, up: 0.42, zoom: 1};
      this.dirty = true;
      try {
        this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: true});
      } catch (e) {
        const note = document.createElement('p');
        note.className = 'legend';
        note.textContent = 'This browser draws no three dimensions (WebGL is missing); the plots below have the same data.';
        parent.append(note);
        return;
      }
      parent.append(this.renderer.domElement);
      this.scene = new THREE.Scene();
      this.camera = new THREE.PerspectiveCamera(38, 4 / 3, 0.001, 500);
      this.marks = ['camera', '1'].map((text) => {
        const mark = document.createElement('span');
        mark.className = text === '1' ? 'mark first' : 'mark';
        mark.textContent = text;
        parent.append(mark);
        return mark;
      });
      this.legend = document.createElement('span');
      this.legend.className = 'legend';
      parent.append(this.legend);
      this.colours();
      this.listen(buttons);
      new ResizeObserver(() => { this.dirty = true; }).observe(parent);
    }

    line(name, width) {
      const material = new THREE.LineMaterial({linewidth: width});
      const line = new THREE.LineSegments2(new THREE.LineSegmentsGeometry(), material);
      line.frustumCulled = false;
      line.visible = false;
      line.name = name;
      this.scene.add(line);
      return line;
    }

    /// Pairs of points.
    set(line, pairs) {
      line.visible = pairs.length > 1;
      if (!line.visible) return;
      line.geometry.dispose();
      line.geometry = new THREE.LineSegmentsGeometry();
      const flat = new Float32Array(pairs.length * 3);
      pairs.forEach((p, i) => place(p).toArray(flat, 3 * i));
      line.geometry.setPositions(flat);
    }

    /// Anew in the theme's colours.
    colours() {
      if (!this.renderer) return;
      if (!this.lines) {
        this.lines = {
          grid: this.line('grid', 1), frustum: this.line('frustum', 1.4), shadow: this.line('shadow', 1.6), drop: this.line('drop', 1.2),
          way: this.line('way', 2.6), square: this.line('square', 3), first: this.line('first', 4.5),
          x: this.line('x', 2.4), y: this.line('y', 2.4), z: this.line('z', 2.4),
        };
        this.face = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({side: THREE.DoubleSide, transparent: true, opacity: 0.22, depthWrite: false}));
        this.face.frustumCulled = false;
        this.face.visible = false;
        this.scene.add(this.face);
      }
      // Wide lines cannot be seen through: fainter ones are nearer the ground's colour.
      const ground = new THREE.Color(berth.colour('stage'));
      const paint = (name, colour, strength = 1) => this.lines[name].material.color.copy(ground).lerp(new THREE.Color(colour), strength);
      const soft = berth.colour('soft'), first = berth.colour('first');
      paint('grid', soft, 0.3);
      paint('frustum', soft, 0.9);
      paint('shadow', soft, 0.6);
      paint('drop', soft, 0.8);
      paint('way', berth.colour('data'));
      paint('square', first);
      paint('first', first);
      paint('x', '#e0483e');
      paint('y', '#3aa75c');
      paint('z', '#3f83e0');
      this.face.material.color.set(first);
      this.dirty = true;
    }

    listen(buttons) {
      this.buttons = buttons;
      buttons.forEach((button) => button.addEventListener('click', () => this.look(button.dataset.view)));
      const dom = this.parent;
      let from = null;
      dom.addEventListener('pointerdown', (event) => {
        from = {x: event.clientX, y: event.clientY, around: this.turn.around, up: this.turn.up};
        dom.setPointerCapture(event.pointerId);
      });
      dom.addEventListener('pointermove', (event) => {
        if (!from) return;
        this.turnTo(from.around - (event.clientX - from.x) * 0.008, from.up + (event.clientY - from.y) * 0.008);
      });
      const stop = () => { from = null; };
      dom.addEventListener('pointerup', stop);
      dom.addEventListener('pointercancel', stop);
      dom.addEventListener('wheel', (event) => {
        if (document.activeElement !== dom) return;  // the page scrolls until the drawing is chosen
        event.preventDefault();
        this.zoom(event.deltaY > 0 ? kZoom : 1 / kZoom);
      }, {passive: false});
      dom.addEventListener('keydown', (event) => {
        const {around, up} = this.turn;
        const keys = {
          ArrowLeft: () => this.turnTo(around - kTurn, up), ArrowRight: () => this.turnTo(around + kTurn, up),
          ArrowUp: () => this.turnTo(around, up + kTurn), ArrowDown: () => this.turnTo(around, up - kTurn),
          '+': () => this.zoom(1 / kZoom), '-': () => this.zoom(kZoom), '=': () => this.zoom(1 / kZoom),
        };
        if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
        event.preventDefault();
        keys[event.key]();
      });
    }

    look(view) {
      this.view = view;
      this.turn.zoom = 1;
      if (view === 'orbit') Object.assign(this.turn, {around: -0.95, up: 0.42});
      this.buttons.forEach((button) => button.setAttribute('aria-pressed', String(button.dataset.view === view)));
      this.dirty = true;
    }
    turnTo(around, up) {
      if (this.view !== 'orbit') this.look('orbit');
      this.turn.around = around;
      this.turn.up = Math.max(-1.45, Math.min(1.45, up));
      this.dirty = true;
    }
    zoom(factor) {
      this.turn.zoom = Math.max(0.15, Math.min(6, this.turn.zoom * factor));
      this.dirty = true;
    }

    clear() {
      this.way = [];
      this.object = null;
      this.dirty = true;
    }

    /// The pyramid of the camera: [fx, fy, cx, cy] and the image's size.
    about(about) {
      this.pinhole = about.camera ? {camera: about.camera, width: about.width, height: about.height} : null;
      this.dirty = true;
    }

    /// Samples of the object shown, in order; `live` is the one to draw the square at, or null.
    show(samples, live, size, gap) {
      this.way = samples.length > kMost ? samples.slice(samples.length - kMost) : samples;
      this.live = live;
      this.size = size;
      this.gap = gap;
      this.dirty = true;
    }

    draw() {
      if (!this.renderer || !this.dirty) return;
      this.dirty = false;
      const width = this.parent.clientWidth, height = this.parent.clientHeight;
      if (!width || !height) return;
      const ratio = window.devicePixelRatio || 1;
      if (this.size2 !== width + 'x' + height + '@' + ratio) {
        this.size2 = width + 'x' + height + '@' + ratio;
        this.renderer.setPixelRatio(ratio);
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        Object.values(this.lines).forEach((line) => line.material.resolution.set(width, height));
      }
      const box = this.bounds();
      this.build(box);
      this.aim(box);
      this.renderer.render(this.scene, this.camera);
      this.parent.dataset.seen = [this.view, this.turn.around.toFixed(2), this.turn.up.toFixed(2), this.turn.zoom.toFixed(2)].join(' ');
      this.label(width, height);
    }

    /// Of the way, the camera and the square.
    bounds() {
      const box = new THREE.Box3();
      box.expandByPoint(new THREE.Vector3(0, 0, 0));
      this.way.forEach((s) => box.expandByPoint(place(s.value)));
      if (this.live) this.corners(this.live).forEach((p) => box.expandByPoint(place(p)));
      if (this.way.length === 0) box.expandByPoint(new THREE.Vector3(0, 0, -0.5));
      return box;
    }

    /// Points that have to be in sight.
    outline(box) {
      const points = [...this.ground, ...this.frustum].map(place), step = Math.ceil(this.way.length / 60);
      for (let i = 0; i < this.way.length; i += step) points.push(place(this.way[i].value));
      for (const x of [box.min.x, box.max.x]) points.push(new THREE.Vector3(x, box.max.y, box.max.z));
      return points;
    }

    corners(sample) {
      const h = (this.size || 0.1) / 2;
      return [[-h, -h, 0], [-h, h, 0], [h, h, 0], [h, -h, 0]].map((p) => moved(sample.value, p));
    }

    build(box) {
      const floor = -(box.min.y - 0.1 * Math.max(0.1, box.max.z - box.min.z));  // y down again
      const pairs = [], shadow = [];
      for (let i = 1; i < this.way.length; ++i) {
        const a = this.way[i - 1], b = this.way[i];
        if (b.time - a.time > this.gap) continue;
        pairs.push(a.value, b.value);
        shadow.push([a.value[0], floor, a.value[2]], [b.value[0], floor, b.value[2]]);
      }
      this.set(this.lines.way, pairs);
      this.set(this.lines.shadow, shadow);
      this.floor(box, floor);
      this.pyramid(box);
      this.set(this.lines.square, []);
      this.set(this.lines.first, []);
      this.set(this.lines.drop, []);
      this.face.visible = false;
      ['x', 'y', 'z'].forEach((name) => this.set(this.lines[name], []));
      if (!this.live) return;
      const c = this.corners(this.live), centre = this.live.value.slice(0, 3);
      this.set(this.lines.square, [c[1], c[2], c[2], c[3], c[3], c[0]]);
      this.set(this.lines.first, [c[0], c[1]]);
      this.set(this.lines.drop, [centre, [centre[0], floor, centre[2]]]);
      const h = (this.size || 0.1) / 2;
      [['x', [h, 0, 0]], ['y', [0, h, 0]], ['z', [0, 0, h]]].forEach(([name, p]) => this.set(this.lines[name], [centre, moved(this.live.value, p)]));
      const flat = [];
      [c[0], c[1], c[2], c[0], c[2], c[3]].forEach((p) => flat.push(...place(p).toArray()));
      this.face.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(flat), 3));
      this.face.visible = true;
    }

    floor(box, floor) {
      const deep = Math.max(0.2, -box.min.z), step = deep > 4 ? 1 : deep > 1.6 ? 0.5 : deep > 0.7 ? 0.2 : 0.1;
      const left = Math.floor(Math.min(box.min.x, -step) / step) * step, right = Math.ceil(Math.max(box.max.x, step) / step) * step;
      const far = Math.ceil(deep / step) * step, pairs = [];
      for (let x = left; x <= right + 1e-9; x += step) pairs.push([x, floor, 0], [x, floor, far]);
      for (let z = 0; z <= far + 1e-9; z += step) pairs.push([left, floor, z], [right, floor, z]);
      this.set(this.lines.grid, pairs);
      this.ground = [[left, floor, 0], [right, floor, 0], [right, floor, far], [left, floor, far]];
      this.legend.textContent = 'squares of ' + berth.length(step);
    }

    pyramidDepth(box) { return Math.max(0.04, 0.1 * (box.max.z - box.min.z)); }

    pyramid(box) {
      const far = this.pyramidDepth(box);
      const p = this.pinhole || {camera: [1, 1, 0.5, 0.4], width: 1, height: 0.8};
      const [fx, fy, cx, cy] = p.camera;
      const corner = (u, v) => [(u - cx) / fx * far, (v - cy) / fy * far, far];
      const c = [corner(0, 0), corner(0, p.height), corner(p.width, p.height), corner(p.width, 0)], o = [0, 0, 0];
      const pairs = [];
      c.forEach((q, i) => pairs.push(o, q, q, c[(i + 1) % 4]));
      this.frustum = c;
      this.set(this.lines.frustum, pairs);
    }

    /// Looks at all of it from where it is asked to, as near as it fits; nearer only when half the room is empty, since
    /// what moves is the object and not the ground.
    aim(box) {
      const {around, up} = this.turn;
      const from = {
        orbit: new THREE.Vector3(Math.sin(around) * Math.cos(up), Math.sin(up), Math.cos(around) * Math.cos(up)),
        top: new THREE.Vector3(0, 1, 0.0001), side: new THREE.Vector3(1, 0, 0.0001), camera: new THREE.Vector3(0, 0.0001, 1),
      }[this.view];
      const centre = box.getCenter(new THREE.Vector3());
      let distance = Math.max(0.2, box.getSize(new THREE.Vector3()).length() * 1.5);
      const stand = (at) => {
        this.camera.position.copy(at).addScaledVector(from, distance);
        this.camera.near = distance / 200;
        this.camera.far = distance * 40;
        this.camera.updateProjectionMatrix();
        this.camera.lookAt(at);
        this.camera.updateMatrixWorld();
      };
      const points = this.outline(box);
      for (let i = 0; i < 4; ++i) {
        stand(centre);
        const seen = points.map((p) => p.clone().project(this.camera));
        const xs = seen.map((p) => p.x), ys = seen.map((p) => p.y);
        const middle = new THREE.Vector3((Math.min(...xs) + Math.max(...xs)) / 2, (Math.min(...ys) + Math.max(...ys)) / 2, centre.clone().project(this.camera).z);
        const half = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys)) / 2;
        centre.copy(middle.unproject(this.camera));
        distance *= Math.max(0.2, half / 0.9);
      }
      const kept = this.kept;
      if (!kept || kept.view !== this.view || distance > kept.distance || distance < 0.6 * kept.distance ||
          centre.distanceTo(kept.centre) > 0.04 * distance || kept.turn !== around + '/' + up) {
        this.kept = {view: this.view, turn: around + '/' + up, distance: distance * 1.04, centre};
      }
      distance = this.kept.distance * this.turn.zoom;
      stand(this.kept.centre);
    }

    label(width, height) {
      const put = (mark, p) => {
        mark.hidden = !p;
        if (!p) return;
        const at = place(p).project(this.camera);
        mark.style.left = (at.x + 1) / 2 * width + 'px';
        mark.style.top = (1 - at.y) / 2 * height + 'px';
      };
      put(this.marks[0], [0, 0, 0]);
      put(this.marks[1], this.live ? this.corners(this.live)[0] : null);
    }
  }
  berth.Scene = Scene;
  berth.rotation = rotation;
})(window.berth);
