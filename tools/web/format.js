// Numbers as people read them, and what the page's parts share.
'use strict';
window.berth = window.berth || {};
(function (berth) {
  const axes = [
    {name: 'x', of: 'right', unit: 'mm', scale: 1000, least: 2},
    {name: 'y', of: 'down', unit: 'mm', scale: 1000, least: 2},
    {name: 'z', of: 'forward', unit: 'mm', scale: 1000, least: 2},
    {name: 'rx', of: 'about x', unit: '°', scale: 1, least: 0.5},
    {name: 'ry', of: 'about y', unit: '°', scale: 1, least: 0.5},
    {name: 'rz', of: 'about z', unit: '°', scale: 1, least: 0.5},
  ];

  /// A sample as the server sends it: an array.
  function sample(a) {
    return {
      time: a[0], object: a[1], value: a.slice(2, 8), deviation: a.slice(8, 14), range: a[14], rangeDeviation: a[15],
      closing: a[16], closingDeviation: a[17], error: a[18], ambiguity: a[19],
    };
  }

  const minus = (text) => text.replace('-', '−');
  const fixed = (value, digits) => (value === null || value === undefined || !isFinite(value) ? '—' : minus(value.toFixed(digits)));

  /// With as many decimals as the deviation is worth, two digits of it at most.
  function measured(value, deviation, most) {
    if (value === null || value === undefined) return '—';
    const digits = deviation > 0 ? Math.min(most, Math.max(0, 1 - Math.floor(Math.log10(deviation)))) : most;
    return fixed(value, digits);
  }

  function length(metres) {
    if (metres === null || metres === undefined) return 'not known';
    const mm = metres * 1000;
    return mm >= 1000 ? fixed(metres, 2) + ' m' : fixed(mm, mm < 1 ? 3 : mm < 10 ? 2 : mm < 100 ? 1 : 0) + ' mm';
  }

  function duration(seconds) {
    if (seconds < 1) return Math.round(seconds * 1000) + ' ms';
    if (seconds < 100) return seconds.toFixed(1) + ' s';
    if (seconds < 7200) return Math.round(seconds / 60) + ' min';
    return Math.round(seconds / 3600) + ' h';
  }

  /// "1,234,567"
  const count = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, ',');

  /// A colour of the style sheet, in the theme that is shown.
  const colours = new Map();
  const colour = (name) => {
    if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim());
    return colours.get(name);
  };

  /// A canvas as large as the screen has pixels for it; its context draws in CSS pixels.
  function crisp(canvas) {
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    const w = Math.round(width * ratio), h = Math.round(height * ratio);
    if (canvas.width !== w || canvas.height !== h) {
      canvas.width = w;
      canvas.height = h;
    }
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return {context, width, height};
  }

  /// Chooses among the page's colours, and tells whoever draws with them.
  function theme(select, changed) {
    let stored = '';
    try { stored = localStorage.getItem('berth-theme') || ''; } catch (e) { /* not allowed to remember */ }
    const repaint = () => {
      colours.clear();
      changed();
    };
    const apply = () => {
      if (select.value) document.documentElement.dataset.theme = select.value;
      else delete document.documentElement.dataset.theme;
      repaint();
    };
    select.value = stored;
    select.addEventListener('change', () => {
      try { localStorage.setItem('berth-theme', select.value); } catch (e) { /* likewise */ }
      apply();
    });
    window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', repaint);
    apply();
  }

  Object.assign(berth, {axes, sample, fixed, measured, length, duration, count, colour, crisp, theme});
})(window.berth);
