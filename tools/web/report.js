// The page of a run that is over.
'use strict';
(function (berth) {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($('data').textContent);
  const ordered = (rows) => data.objects.map((_, i) => rows.map(berth.sample).filter((s) => s.object === i));
  const tracks = ordered(data.samples), truths = ordered(data.truth);
  const all = tracks.flat(), from = 0, to = Math.max(1e-3, ...all.map((s) => s.time));
  const plots = berth.axes.map((axis, i) => new berth.Plot($('plots'), axis, i));
  const scene = new berth.Scene($('scene'), [...document.querySelectorAll('[data-view]')]);
  const gap = Math.max(0.3, 4 * data.every * to / Math.max(1, data.frames));

  const median = (values) => {
    const sorted = values.filter((v) => v !== null && isFinite(v)).sort((a, b) => a - b);
    return sorted.length ? sorted[Math.floor((sorted.length - 1) / 2)] : null;
  };

  /// Of an object's samples against the truth at the same time: metres and degrees.
  function errors(i) {
    const known = new Map(truths[i].map((s) => [s.time, s]));
    return tracks[i].filter((s) => known.has(s.time)).map((s) => {
      const t = known.get(s.time), d = [0, 1, 2].map((k) => s.value[k] - t.value[k]);
      const a = berth.rotation(s.value), b = berth.rotation(t.value);
      let trace = 0;
      for (let r = 0; r < 3; ++r) for (let k = 0; k < 3; ++k) trace += a[r][k] * b[r][k];
      return {metres: Math.hypot(...d), degrees: Math.acos(Math.max(-1, Math.min(1, (trace - 1) / 2))) * 180 / Math.PI};
    });
  }

  function row(table, cells, name) {
    const line = table.insertRow();
    line.className = name || '';
    cells.forEach((text) => { line.insertCell().textContent = text; });
  }

  function facts() {
    const about = data.about, list = [['source', about.source], ['backend', about.backend], ['images', about.width + ' × ' + about.height],
      ['took', berth.duration(data.wall_s) + ', ' + berth.fixed(data.frames / Math.max(1e-3, data.wall_s), 1) + ' frames/s']];
    Object.entries(data.states || {}).forEach(([name, n]) => list.push(['status ' + name.replace('_', ' '), berth.count(n) + ' frames']));
    Object.entries(data.searches || {}).forEach(([name, n]) => list.push(['searched: ' + name, berth.count(n) + ' frames']));
    if (data.pipeline) list.push(['late', data.pipeline.late.map(berth.count).join(', ') + ' frames past each deadline']);
    const camera = data.camera;
    if (camera.lost + camera.incomplete + camera.repeated + camera.misdated + camera.reopened) list.push(['camera', camera.lost + ' lost, ' + camera.incomplete + ' incomplete, ' + camera.repeated + ' repeated, ' + camera.misdated + ' with impossible times, opened again ' + camera.reopened + ' ×']);
    list.forEach(([name, value]) => {
      const term = document.createElement('dt'), text = document.createElement('dd');
      term.textContent = name;
      text.textContent = value;
      $('facts').append(term, text);
    });
  }

  function glance() {
    $('source').textContent = data.about.source + ', ' + data.date;
    $('frames').textContent = berth.count(data.frames);
    $('frames-sub').textContent = 'over ' + berth.duration(to) + ' of the camera’s time';
    $('with-pose').textContent = data.frames ? berth.fixed(100 * data.with_pose / data.frames, 1) : '—';
    $('with-pose-sub').textContent = berth.count(data.with_pose) + ' frames';
    const p = data.pipeline;
    $('dropped').textContent = p ? berth.count(Object.values(p.dropped).reduce((a, b) => a + b, 0)) : '0';
    $('dropped-sub').textContent = p ? 'of ' + berth.count(p.offered) + ' offered' : 'frame by frame, none can be';
    data.times.forEach((cells) => row($('times'), cells.map((cell, i) => (i ? berth.fixed(cell, cell < 10 ? 2 : 1) : cell))));
    data.objects.forEach((object, i) => {
      const track = tracks[i], ranges = track.map((s) => s.range), wrong = errors(i);
      const most = (values) => values.reduce((a, b) => Math.max(a, b), 0);
      row($('objects'), [object.name, berth.count(track.length), ranges.length ? berth.fixed(Math.min(...ranges), 3) + ' – ' + berth.fixed(most(ranges), 3) : '—',
        berth.length(median(track.map((s) => s.rangeDeviation))), berth.fixed(median(track.map((s) => s.error)), 3),
        ...(wrong.length ? [berth.length(median(wrong.map((w) => w.metres))), berth.length(most(wrong.map((w) => w.metres))),
          berth.fixed(median(wrong.map((w) => w.degrees)), 3) + '°', berth.fixed(most(wrong.map((w) => w.degrees)), 2) + '°'] : ['—', '—', '—', '—'])]);
      $('object').add(new Option(object.name, String(i)));
    });
    const notes = [];
    if (data.every > 1) notes.push('Every ' + data.every + 'th frame is in this page.');
    if (data.beyond) notes.push(berth.count(data.beyond) + ' poses of further objects are not.');
    if (data.truth.length) notes.push('“Off” and “turned” are against the simulation’s truth, thin lines in the plots.');
    $('objects-note').textContent = notes.join(' ');
    data.changes.forEach(([time, what]) => {
      const item = document.createElement('li'), at = document.createElement('time');
      at.textContent = berth.fixed(time, 2) + ' s';
      item.append(at, what);
      $('log').append(item);
    });
    $('about').textContent = 'Berth ' + data.about.version;
  }

  function show() {
    const i = Number($('object').value || 0), track = tracks[i] || [], time = to * Number($('time').value) / 1000;
    let at = track.length - 1;
    while (at > 0 && track[at].time > time + 1e-9) --at;
    const sample = track[at] && Math.abs(track[at].time - time) <= gap ? track[at] : null;
    $('moment').textContent = berth.fixed(time, 2) + ' s';
    plots.forEach((plot) => {
      plot.draw(track, from, to, gap, berth.since, {truth: truths[i], cursor: time});
      plot.read(sample);
    });
    const end = track[track.length - 1];
    $('range').textContent = end ? berth.measured(end.range, end.rangeDeviation, 4) : '—';
    $('range-sub').textContent = end ? '± ' + berth.length(end.rangeDeviation) : 'no pose';
    $('plots-note').textContent = data.objects[i] ? data.objects[i].name : 'no object had a pose';
    scene.show(track, sample, data.objects[i] ? data.objects[i].size : 0, gap);
    scene.draw();
  }

  facts();
  glance();
  // What docking goes by: the largest, bundles and targets first.
  const rank = {bundle: 0, target: 1, marker: 2};
  const best = data.objects.map((o, i) => i).sort((a, b) => rank[data.objects[a].kind] - rank[data.objects[b].kind] || data.objects[b].size - data.objects[a].size || tracks[b].length - tracks[a].length)[0];
  if (best !== undefined) $('object').value = String(best);
  scene.about(data.about);
  berth.theme($('theme'), () => { scene.colours(); show(); });
  ['object', 'time'].forEach((id) => $(id).addEventListener('input', show));
  document.querySelectorAll('[data-view]').forEach((button) => button.addEventListener('click', show));
  $('scene').addEventListener('pointermove', () => scene.draw());
  $('scene').addEventListener('keydown', () => scene.draw());
  window.addEventListener('resize', show);
  show();
})(window.berth);
