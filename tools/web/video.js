// The camera's image and what was found in it, picture by picture: the overlay comes with the picture it belongs to.
'use strict';
(function (berth) {
  const kColours = {edge: '#4be08a', first: '#ff5046', x: '#ff5046', y: '#4be08a', z: '#5aa2ff', text: '#ffe45e', window: '#9fd0ff'};
  const kReopenAfter = 1.0;    // s
  const text = new TextDecoder('latin1');

  /// Reads multipart/x-mixed-replace: hands each part's headers and bytes on.
  async function parts(reader, take) {
    let buffer = new Uint8Array(0);
    for (;;) {
      const end = find(buffer, '\r\n\r\n', find(buffer, '--', 0));
      if (end >= 0) {
        const head = text.decode(buffer.subarray(0, end));
        const length = /content-length: *(\d+)/i.exec(head);
        if (length && buffer.length >= end + 4 + Number(length[1])) {
          const from = end + 4, to = from + Number(length[1]);
          take(head, buffer.slice(from, to));
          buffer = buffer.slice(to);
          continue;
        }
      }
      const {done, value} = await reader.read();
      if (done) return;
      const joined = new Uint8Array(buffer.length + value.length);
      joined.set(buffer);
      joined.set(value, buffer.length);
      buffer = joined;
    }
  }
  function find(bytes, word, from) {
    if (from < 0) return -1;
    const codes = Array.from(word, (c) => c.charCodeAt(0));
    for (let i = from; i + codes.length <= bytes.length; ++i) {
      if (codes.every((code, k) => bytes[i + k] === code)) return i;
    }
    return -1;
  }

  class Video {
    constructor(canvas, url) {
      this.canvas = canvas;
      this.url = url;
      this.overlay = true;
      this.picture = null;
      this.count = 0;
    }

    start() {
      if (this.stopper) return;
      this.stopper = new AbortController();
      this.run(this.stopper.signal);
    }
    stop() {
      if (this.stopper) this.stopper.abort();
      this.stopper = null;
    }
    /// Of a run that is over.
    forget() { this.picture = null; }

    async run(signal) {
      while (!signal.aborted) {
        try {
          const response = await fetch(this.url, {signal, cache: 'no-store'});
          if (response.ok) await parts(response.body.getReader(), (head, bytes) => this.take(head, bytes));
          this.refused = response.status === 503;
        } catch (e) {
          if (signal.aborted) return;
        }
        await new Promise((done) => setTimeout(done, kReopenAfter * 1000));
      }
    }

    async take(head, bytes) {
      // A picture that is only sent again says nothing new.
      if (/x-berth-repeated: *1/i.test(head)) return;
      const about = /x-berth-picture: *(.*)/i.exec(head);
      await this.put(about ? JSON.parse(about[1]) : {}, bytes);
    }

    /// Shows this one.
    async put(about, bytes) {
      const image = await createImageBitmap(new Blob([bytes], {type: 'image/jpeg'}));
      this.picture = {image, about};
      ++this.count;
      this.canvas.dataset.count = this.count;
      this.fresh = true;
    }

    /// `age` in s of the picture, and whether it counts as live.
    draw(isLive, age) {
      const {context: c, width, height} = berth.crisp(this.canvas);
      c.clearRect(0, 0, width, height);
      if (!this.picture) return this.say(c, width, height, 'no picture yet', false);
      const {image, about} = this.picture;
      const scale = Math.min(width / image.width, height / image.height);
      const left = (width - image.width * scale) / 2, top = (height - image.height * scale) / 2;
      c.filter = isLive ? 'none' : 'grayscale(1) brightness(0.45)';
      c.drawImage(image, left, top, image.width * scale, image.height * scale);
      c.filter = 'none';
      if (!isLive) {
        this.hatch(c, width, height);
        return this.say(c, width, height, age === null || age < 1 ? 'not live' : 'this picture is ' + berth.duration(age) + ' old', true);
      }
      if (!this.overlay) return;
      // Pixel centres are at integers, in the camera's image, which the picture may be a smaller one of.
      const shrink = about.width ? image.width / about.width : 1;
      const at = ([u, v]) => [left + (u + 0.5) * shrink * scale, top + (v + 0.5) * shrink * scale];
      (about.windows || []).forEach((w) => {
        const [x, y] = at([w[0] - 0.5, w[1] - 0.5]), side = w[2] * shrink * scale;
        c.setLineDash([5, 4]);
        c.strokeStyle = kColours.window;
        c.lineWidth = 1;
        c.strokeRect(x, y, side, side);
        c.setLineDash([]);
      });
      (about.objects || []).forEach((object) => this.object(c, object, at));
    }

    object(c, object, at) {
      const corners = (object.corners || []).map(at);
      if (corners.length === 4) {
        for (let i = 1; i < 4; ++i) this.line(c, corners[i], corners[(i + 1) % 4], kColours.edge, 2);
        this.line(c, corners[0], corners[1], kColours.first, 2.4);
      }
      (object.points || []).map(at).forEach((p) => this.dot(c, p, kColours.text, 2.5));
      if (object.axes) {
        const [o, x, y, z] = object.axes.map((p) => p && at(p));
        [[x, 'x'], [y, 'y'], [z, 'z']].forEach(([end, name]) => {
          if (!o || !end) return;
          this.line(c, o, end, kColours[name], 2.2);
          const d = Math.hypot(end[0] - o[0], end[1] - o[1]) || 1;
          if (d > 24) this.word(c, name, [end[0] + (end[0] - o[0]) / d * 9, end[1] + (end[1] - o[1]) / d * 9], kColours[name], 12);
        });
      }
      if (corners.length === 4) this.corners(c, corners);
      const all = corners.length ? corners : (object.axes || []).filter(Boolean).map(at);
      const wide = Math.max(...all.map((p) => p[0])) - Math.min(...all.map((p) => p[0]));
      if (!all.length || !(wide > 30)) return;  // names would cover each other
      const x = all.reduce((sum, p) => sum + p[0], 0) / all.length, y = Math.max(...all.map((p) => p[1]));
      this.word(c, object.name, [x, y + 24], kColours.text, 12);
    }

    corners(c, corners) {
      const x = corners.reduce((sum, p) => sum + p[0], 0) / 4, y = corners.reduce((sum, p) => sum + p[1], 0) / 4;
      this.dot(c, corners[0], kColours.first, 4.5);
      const reach = Math.max(...corners.map((p) => Math.hypot(p[0] - x, p[1] - y)));
      if (reach < 20) return;  // numbers would cover it
      corners.forEach((p, i) => {
        const d = Math.hypot(p[0] - x, p[1] - y) || 1;
        this.word(c, String(i + 1), [p[0] + (p[0] - x) / d * 12, p[1] + (p[1] - y) / d * 12], i === 0 ? kColours.first : kColours.edge, i === 0 ? 14 : 11);
      });
    }

    /// Every mark lies on a darker one, so that it shows on any ground.
    line(c, a, b, colour, width) {
      for (const [style, w] of [['rgba(0,0,0,.65)', width + 2], [colour, width]]) {
        c.strokeStyle = style;
        c.lineWidth = w;
        c.lineCap = 'round';
        c.beginPath();
        c.moveTo(a[0], a[1]);
        c.lineTo(b[0], b[1]);
        c.stroke();
      }
    }
    dot(c, p, colour, radius) {
      for (const [style, r] of [['rgba(0,0,0,.65)', radius + 1], [colour, radius]]) {
        c.fillStyle = style;
        c.beginPath();
        c.arc(p[0], p[1], r, 0, 7);
        c.fill();
      }
    }
    word(c, word, p, colour, size) {
      c.font = '600 ' + size + 'px system-ui, sans-serif';
      c.textAlign = 'center';
      c.textBaseline = 'middle';
      c.lineWidth = 3;
      c.strokeStyle = 'rgba(0,0,0,.75)';
      c.lineJoin = 'round';
      c.strokeText(word, p[0], p[1]);
      c.fillStyle = colour;
      c.fillText(word, p[0], p[1]);
    }
    hatch(c, width, height) {
      c.strokeStyle = 'rgba(255,80,70,.28)';
      c.lineWidth = 7;
      for (let x = -height; x < width; x += 34) {
        c.beginPath();
        c.moveTo(x, height);
        c.lineTo(x + height, 0);
        c.stroke();
      }
    }
    say(c, width, height, words, isLoud) {
      c.font = (isLoud ? '650 ' : '') + Math.round(Math.max(14, width / 24)) + 'px system-ui, sans-serif';
      c.textAlign = 'center';
      c.textBaseline = 'middle';
      if (isLoud) {
        const w = c.measureText(words).width + 36, h = Math.max(30, width / 13);
        c.fillStyle = '#b3201b';
        c.fillRect((width - w) / 2, (height - h) / 2, w, h);
      }
      c.fillStyle = isLoud ? '#ffffff' : berth.colour('soft');
      c.fillText(words, width / 2, height / 2);
    }
  }
  berth.Video = Video;
})(window.berth);
