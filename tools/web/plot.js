// One of the six plots: a value over time with a band of one standard deviation, and gaps where there was no pose.
'use strict';
(function (berth) {
  const kLeft = 46, kRight = 8, kTop = 6, kBottom = 18;

  function niceStep(span, most) {
    const raw = span / most, power = Math.pow(10, Math.floor(Math.log10(raw)));
    for (const m of [1, 2, 5]) if (raw <= m * power) return m * power;
    return 10 * power;
  }

  class Plot {
    /// `axis`: one of berth.axes, of the number `index`.
    constructor(parent, axis, index) {
      this.axis = axis;
      this.index = index;
      this.low = null;
      this.high = null;
      const box = document.createElement('div');
      box.className = 'plot';
      const head = document.createElement('h3');
      head.append(axis.name);
      const of = document.createElement('span');
      of.className = 'of';
      of.textContent = axis.of + ', ' + axis.unit;
      this.readout = document.createElement('output');
      head.append(of, this.readout);
      this.canvas = document.createElement('canvas');
      this.canvas.setAttribute('role', 'img');
      this.canvas.setAttribute('aria-label', axis.name + ' (' + axis.of + ') over time');
      box.append(head, this.canvas);
      parent.append(box);
    }

    /// Wide enough at once, narrow again only when half of it is empty: scales that jump about tire the eye.
    fit(low, high) {
      const least = this.axis.least, middle = (low + high) / 2, span = Math.max(high - low, least);
      low = middle - span * 0.58;
      high = middle + span * 0.58;
      if (this.low === null || low < this.low || high > this.high || span < 0.5 * (this.high - this.low)) {
        this.low = low - span * 0.08;
        this.high = high + span * 0.08;
      }
    }

    /// Samples of one object in order of time, from `from` to `to` s; lines break where two are further apart than
    /// `gap`. `tick` names a time. Options: `truth`, samples for a thin line beneath; `cursor`, a time to mark.
    draw(samples, from, to, gap, tick, options = {}) {
      const {context: c, width, height} = berth.crisp(this.canvas);
      c.clearRect(0, 0, width, height);
      if (width < 80) return;
      const scale = this.axis.scale, i = this.index;
      let first = samples.length;
      while (first > 0 && samples[first - 1].time >= from) --first;
      const shown = samples.slice(first);
      let low = Infinity, high = -Infinity;
      for (const s of shown) {
        const deviation = s.deviation[i] || 0;
        low = Math.min(low, (s.value[i] - deviation) * scale);
        high = Math.max(high, (s.value[i] + deviation) * scale);
      }
      if (shown.length) this.fit(low, high);
      const right = width - kRight, bottom = height - kBottom;
      const x = (t) => kLeft + (t - from) / (to - from) * (right - kLeft);
      const y = (v) => bottom - (v - this.low) / (this.high - this.low) * (bottom - kTop);
      this.grid(c, width, height, from, to, x, y, tick);
      c.save();
      c.beginPath();
      c.rect(kLeft, kTop, right - kLeft, bottom - kTop);
      c.clip();
      if (options.truth) this.truth(c, options.truth, x, y, from, to, gap);
      for (let start = 0; start < shown.length;) {
        let end = start + 1;
        while (end < shown.length && shown[end].time - shown[end - 1].time <= gap && !this.turns(shown[end - 1], shown[end])) ++end;
        this.run(c, shown.slice(start, end), x, y);
        start = end;
      }
      if (options.cursor !== undefined) {
        c.strokeStyle = berth.colour('first');
        c.lineWidth = 1;
        c.beginPath();
        c.moveTo(x(options.cursor), kTop);
        c.lineTo(x(options.cursor), bottom);
        c.stroke();
      }
      c.restore();
    }

    /// An angle that passes ±180° is no line across the plot.
    turns(a, b) { return this.index > 2 && Math.abs(a.value[this.index] - b.value[this.index]) > 180; }

    run(c, run, x, y) {
      const i = this.index, scale = this.axis.scale;
      c.fillStyle = berth.colour('band');
      c.beginPath();
      run.forEach((s) => c.lineTo(x(s.time), y((s.value[i] + (s.deviation[i] || 0)) * scale)));
      run.slice().reverse().forEach((s) => c.lineTo(x(s.time), y((s.value[i] - (s.deviation[i] || 0)) * scale)));
      c.fill();
      c.strokeStyle = berth.colour('data');
      c.lineWidth = 1.6;
      c.lineJoin = 'round';
      c.beginPath();
      run.forEach((s) => c.lineTo(x(s.time), y(s.value[i] * scale)));
      if (run.length === 1) c.arc(x(run[0].time), y(run[0].value[i] * scale), 1, 0, 7);
      c.stroke();
    }

    truth(c, truth, x, y, from, to, gap) {
      const i = this.index, scale = this.axis.scale;
      c.strokeStyle = berth.colour('soft');
      c.lineWidth = 1;
      c.beginPath();
      truth.forEach((s, k) => {
        if (s.time < from || s.time > to) return;
        const joined = k > 0 && s.time - truth[k - 1].time <= gap && !this.turns(truth[k - 1], s);
        c[joined ? 'lineTo' : 'moveTo'](x(s.time), y(s.value[i] * scale));
      });
      c.stroke();
    }

    grid(c, width, height, from, to, x, y, tick) {
      const bottom = height - kBottom, right = width - kRight;
      c.font = '11px system-ui, sans-serif';
      c.fillStyle = berth.colour('soft');
      c.strokeStyle = berth.colour('grid');
      c.lineWidth = 1;
      if (this.low !== null) {
        const step = niceStep(this.high - this.low, 4), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
        c.textAlign = 'right';
        c.textBaseline = 'middle';
        for (let v = Math.ceil(this.low / step) * step; v <= this.high; v += step) {
          c.beginPath();
          c.moveTo(kLeft, Math.round(y(v)) + 0.5);
          c.lineTo(right, Math.round(y(v)) + 0.5);
          c.stroke();
          c.fillText(berth.fixed(Math.abs(v) < step / 1e6 ? 0 : v, digits), kLeft - 6, y(v));
        }
      }
      const step = niceStep(to - from, width < 300 ? 3 : 6);
      c.textBaseline = 'alphabetic';
      for (const {time, text} of tick(from, to, step)) {
        const at = Math.round(x(time)) + 0.5;
        c.beginPath();
        c.moveTo(at, kTop);
        c.lineTo(at, bottom);
        c.stroke();
        c.textAlign = at > right - 20 ? 'right' : 'center';
        c.fillText(text, at, height - 4);
      }
    }

    /// The value in words; none of what is not live.
    read(sample) {
      const i = this.index, scale = this.axis.scale;
      if (!sample) {
        this.readout.textContent = '—';
        return;
      }
      const deviation = sample.deviation[i] === null ? null : sample.deviation[i] * scale;
      this.readout.textContent = berth.measured(sample.value[i] * scale, deviation, 3) +
        (deviation === null ? '' : ' ± ' + berth.measured(deviation, deviation, 3)) + ' ' + this.axis.unit;
    }
  }

  /// Ticks that say how long ago.
  berth.ago = (from, to, step) => {
    const ticks = [];
    for (let back = 0; back <= to - from + 1e-9; back += step) {
      ticks.push({time: to - back, text: back === 0 ? 'now' : '−' + berth.fixed(back, step < 1 ? 1 : 0) + ' s'});
    }
    return ticks;
  };
  /// Ticks that say when.
  berth.since = (from, to, step) => {
    const ticks = [];
    for (let t = Math.ceil(from / step) * step; t <= to + 1e-9; t += step) {
      ticks.push({time: t, text: berth.fixed(t, step < 1 ? 1 : 0) + ' s'});
    }
    return ticks;
  };
  berth.Plot = Plot;
})(window.berth);
