// A recording, looked through: where in it the page stands, what that frame holds, and the whole of it for the plots.
'use strict';
(function (berth) {
  const kSecond = 1, kRetryAfter = 500;  // s of the recording; ms
  const $ = (id) => document.getElementById(id);

  class Recording {
    /// `about`: the server's, with `recording`. `on.track(objects, samples)` as the whole is read, `on.picture(about,
    /// bytes)` (null where there is none) for the frame that is shown now, and `on.changed()` after either.
    constructor(about, on) {
      this.on = on;
      this.count = about.recording.frames;
      this.lack = about.recording.lack;
      this.times = [];
      this.index = 0;
      this.frame = null;
      this.track = null;
      this.wanted = null;
      this.playing = null;
      this.listeners = new AbortController();
      const slider = $('moment'), listen = {signal: this.listeners.signal};
      slider.max = this.count - 1;
      slider.value = 0;
      slider.addEventListener('input', () => this.choose(Number(slider.value)), listen);
      document.addEventListener('keydown', (event) => this.press(event), listen);
      $('play').addEventListener('click', () => this.toggle(), listen);
      $('speed').addEventListener('change', () => { if (this.playing) this.play(); }, listen);
      this.seek(0);
      this.load();
    }

    /// Another one takes its place.
    close() {
      this.pause();
      this.closed = true;
      this.listeners.abort();
    }

    /// s, from the first frame to the last that has been read.
    get length() { return this.times.length ? this.times[this.times.length - 1] : 0; }
    get time() { return this.frame ? this.frame.time : 0; }
    /// Further apart, two samples are of two stretches.
    get gap() { return Math.max(0.3, 4 * (this.track ? this.track.every : 1) * this.length / Math.max(1, this.times.length)); }

    /// All of it, once, as far as the server has read it.
    async load() {
      while (!this.closed && this.times.length < this.count) {
        const from = this.times.length;
        try {
          const response = await fetch('track.json?from=' + from);
          if (response.ok) {
            const track = await response.json();
            if (this.closed) return;
            this.track = track;
            this.times.push(...this.track.times);
            this.on.track(this.track.objects, this.track.samples.map(berth.sample), this.track.stages);
            this.tell();
            this.on.changed();
          }
        } catch (e) { /* the page says that there is no connection */ }
        if (this.times.length === from) await new Promise((done) => setTimeout(done, kRetryAfter));
      }
    }

    /// Shows a frame; of those asked for while one is on its way, the newest.
    async seek(index) {
      this.index = Math.max(0, Math.min(this.count - 1, index));
      $('moment').value = this.index;
      this.tell();
      if (this.wanted !== null) {
        this.wanted = this.index;
        return;
      }
      this.wanted = this.index;
      for (let shown = null; shown !== this.wanted && !this.closed;) {
        shown = this.wanted;
        try {
          await this.fetch(shown);
        } catch (e) {
          if (shown === this.wanted) await new Promise((done) => setTimeout(done, kRetryAfter));
          shown = null;  // no connection: once more
        }
      }
      this.wanted = null;
    }

    async fetch(index) {
      const ask = '?frame=' + index;
      const response = await fetch('frame.json' + ask);
      if (response.status === 503) throw new Error('too many connections');  // later there may be room
      const frame = response.ok ? await response.json() : {frame: index, time: this.times[index] || 0, wrong: await response.text(), samples: []};
      let picture = null;
      if (frame.picture) {
        const answer = await fetch('picture.jpg' + ask);
        if (answer.ok) picture = {about: JSON.parse(answer.headers.get('X-Berth-Picture')), bytes: await answer.arrayBuffer()};
      }
      if (this.closed) return;
      await this.on.picture(picture && picture.about, picture && picture.bytes);
      this.frame = frame;
      this.tell();
      this.on.changed();
    }

    /// The last frame at that time or before.
    at(time) {
      let low = 0, high = this.times.length;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (this.times[middle] <= time) low = middle + 1;
        else high = middle;
      }
      return Math.max(0, low - 1);
    }
    now() { return this.times[this.index] === undefined ? this.time : this.times[this.index]; }

    /// By a person: playing stops.
    choose(index) {
      this.pause();
      this.seek(index);
    }

    press(event) {
      const on = document.activeElement;
      if ((on !== document.body && on !== $('moment')) || event.ctrlKey || event.metaKey || event.altKey) return;
      const by = (frames) => () => this.choose(this.index + frames);
      // A frame at least, where the next is more than a second away.
      const later = () => this.choose(Math.max(this.index + 1, this.at(this.now() + kSecond)));
      const earlier = () => this.choose(Math.min(this.index - 1, this.at(this.now() - kSecond)));
      const keys = {
        ArrowRight: by(1), ArrowUp: by(1), ArrowLeft: by(-1), ArrowDown: by(-1), PageUp: later, PageDown: earlier,
        Home: () => this.choose(0), End: () => this.choose(this.count - 1), ' ': () => this.toggle(),
      };
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    }

    toggle() {
      if (this.playing) this.pause();
      else this.play();
    }
    pause() {
      clearInterval(this.playing);
      this.playing = null;
      $('play').textContent = 'Play';
    }
    /// By the recording's own times; what cannot be shown in time is passed over.
    play() {
      this.pause();
      if (this.index >= this.times.length - 1) this.seek(0);
      const speed = Number($('speed').value), from = this.now(), began = berth.now();
      $('play').textContent = 'Pause';
      this.playing = setInterval(() => {
        const index = this.at(from + (berth.now() - began) * speed);
        if (index !== this.index) this.seek(index);
        if (index >= this.count - 1) this.pause();
      }, 20);
    }

    tell() {
      const time = berth.fixed(this.now(), 2) + ' s', which = 'frame ' + berth.count(this.index + 1) + ' of ' + berth.count(this.count);
      $('moment').setAttribute('aria-valuetext', time + ', ' + which);
      $('moment-text').textContent = time + ' · ' + which;
      const share = this.times.length / this.count;
      $('moment-note').textContent = share < 1 ? 'read so far: ' + Math.floor(100 * share) + ' %' : '';
    }

    /// What is well and what is not, with its grade: of the frame, the file, and all that was read of it.
    lines() {
      const all = this.track, lines = [['', 'this frame: ' + this.frame.status.replace('_', ' ')]];
      if (!this.frame.picture) lines.push(['warn', 'this frame was recorded without its picture']);
      lines.push(this.lack ? ['warn', this.lack] : ['', 'the file is whole, by its index']);
      if (!all) return lines;
      if (all.missed) lines.push(['warn', berth.count(all.missed) + ' frames were dropped while recording']);
      if (all.every > 1) lines.push(['', 'plots: every ' + all.every + 'th frame']);
      if (all.beyond) lines.push(['warn', berth.count(all.beyond) + ' poses of further objects are not shown']);
      all.problems.forEach((problem) => lines.push(['bad', problem]));
      if (all.problem_count > all.problems.length) lines.push(['bad', 'and ' + (all.problem_count - all.problems.length) + ' more']);
      return lines;
    }

    /// The sample of an object in the frame that is shown; null where it is not seen. The closing speed is that of the
    /// last sample of the whole before it, `track`.
    seen(object, track) {
      const found = this.frame && object && this.frame.samples.find((one) => one.name === object.name && one.kind === object.kind);
      if (!found) return null;
      const sample = berth.sample(found.sample);
      const before = track.filter((one) => one.time <= sample.time + 1e-4 && sample.time - one.time <= this.gap).pop();
      sample.closing = before ? before.closing : null;
      sample.closingDeviation = before ? before.closingDeviation : null;
      return sample;
    }
  }
  berth.Recording = Recording;
})(window.berth);
