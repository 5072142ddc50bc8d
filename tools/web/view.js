// The page: what the server says, put where people look for it. Nothing old is shown as if it were live: values go when
// their frame is too old, and the page says so in words and in colour.
'use strict';
(function (berth) {
  const $ = (id) => document.getElementById(id);
  const kKept = 12000;          // samples of an object
  const kOldest = 130;          // s of them that plots can show
  const kGone = 1.0;            // s without an event until the connection counts as lost
  const kRankOf = {bundle: 0, target: 1, marker: 2};

  const kAlarms = {
    stale: ['NO LIVE DATA', (age) => 'The newest frame is ' + berth.duration(age) + ' old. No value is shown until frames come again.'],
    lost: ['NO CONNECTION', (age) => 'Nothing has come from Berth for ' + berth.duration(age) + '. Trying again by itself.'],
    ended: ['THE RUN HAS ENDED', () => 'What is shown is its end; nothing here is live.'],
  };

  let about = {}, state = null, objects = [], tracks = [], chosen = -1, page = 'connecting', connected = false, connectedOnce = false;
  let recording = null;         // what is looked through, in place of a run
  let spoken = 0, drawn = 0, plotted = 0, listed = 0;

  const video = new berth.Video($('video'), 'video.mjpg');
  const plots = berth.axes.map((axis, i) => new berth.Plot($('plots'), axis, i));
  const scene = new berth.Scene($('scene'), [...document.querySelectorAll('[data-view]')]);
  const stream = new berth.Stream('events', {
    about: (message) => {
      if (recording && about.run === message.run) return;  // connected again
      if (about.run && about.run !== message.run) note('another run');
      about = message;
      if (recording) recording.close();
      recording = null;
      objects = [];
      tracks = [];
      chosen = -1;
      video.forget();
      scene.clear();
      scene.about(about);
      $('object').length = 1;
      openRecording();
      watch();
      $('source').textContent = about.source;
      $('source').title = about.source;
      $('control').hidden = !about.control;
      $('about').textContent = 'Berth ' + about.version + (about.control ? '' : ' · read-only');
    },
    connection: (isThere) => {
      if (connectedOnce && isThere) note('connected again');
      if (connectedOnce && connected && !isThere && page !== 'ended') note('connection lost');
      connected = isThere;
      connectedOnce = connectedOnce || isThere;
    },
    state: take,
  });

  function take(message) {
    const before = state;
    state = message;
    if (recording) return;
    (message.objects || []).forEach((object, i) => {
      const at = message.objects_from + i;
      objects[at] = object;
      tracks[at] = [];
      $('object').add(new Option(object.name, String(at)));
    });
    (message.samples || []).forEach((array) => {
      const sample = berth.sample(array), track = tracks[sample.object];
      track.push(sample);
      if (track.length > kKept) track.splice(0, track.length - kKept);
    });
    if (message.samples) scene.dirty = true;
    if (message.times) showTimes(message.times);
    if (before && before.frames && message.frames) compare(before, message);
  }

  function openRecording() {
    $('scrub').hidden = !about.recording;
    say('age-name', about.recording ? 'At' : 'Age of data');
    if (!about.recording) {
      delete document.documentElement.dataset.recording;
      return;
    }
    document.documentElement.dataset.recording = '';
    recording = new berth.Recording(about, {
      track: (all, samples, stages) => {
        for (let at = objects.length; at < all.length; ++at) {
          objects[at] = all[at];
          tracks[at] = [];
          $('object').add(new Option(all[at].name, String(at)));
        }
        samples.forEach((sample) => tracks[sample.object].push(sample));
        showTimes(stages);
      },
      picture: (picture, bytes) => {
        if (picture) return video.put(picture, bytes);
        video.forget();
        video.fresh = true;
      },
      changed: () => { plotted = listed = 0; },
    });
  }

  /// What changed from one state to the next and is worth a line.
  function compare(a, b) {
    if (a.frames > b.frames) return;
    if (a.mode !== b.mode) note('mode: ' + b.mode);
    if (a.backend !== b.backend) note('backend: ' + b.backend);
    if (b.camera.reopened > a.camera.reopened) note('the camera was opened again');
    if (b.camera.lost > a.camera.lost) note(b.camera.lost - a.camera.lost + ' frames lost before they came');
    if (b.overflows > a.overflows) note('a list ran full in ' + (b.overflows - a.overflows) + ' frames');
    if (b.pipeline && a.pipeline && b.pipeline.run_again > a.pipeline.run_again) note('the device was lost; frames were run again');
  }

  function note(text) {
    const item = document.createElement('li'), time = document.createElement('time');
    time.textContent = new Date().toLocaleTimeString([], {hour12: false});
    item.append(time, text);
    $('log').prepend(item);
    while ($('log').children.length > 50) $('log').lastChild.remove();
  }

  /// A run's video, where somebody sees it; a recording's pictures come one by one.
  function watch() {
    if (about.run && !recording && $('video-on').checked && !document.hidden) video.start();
    else video.stop();
  }

  // ---- what is live ----

  /// s from one frame to the next; in the first second, while that is not known, a fast camera's.
  const period = () => 1 / Math.max(0.1, state.fps || 10);
  const gap = () => Math.max(0.3, 3 * period());
  const limit = () => Math.max(0.5, Math.min(3, 4 * period()));
  const age = () => (state && state.frames ? Math.max(0, stream.now() - state.captured) : null);

  function judge() {
    if (recording && stream.silence() <= kGone) return 'recording';
    if (!state || stream.silence() > kGone) return state && state.ended ? 'ended' : connectedOnce ? 'lost' : 'connecting';
    if (state.ended) return 'ended';
    if (!state.frames) return 'waiting';
    return age() > limit() ? 'stale' : 'live';
  }

  /// Whether values belong to a frame that may be looked at: the newest, or the recording's.
  const isShown = () => page === 'live' || page === 'recording';

  /// The object's newest sample, where the newest frame shows it, or the recording's frame does; or null.
  function seen(at) {
    if (recording) return recording.seen(objects[at], tracks[at] || []);
    const track = tracks[at] || [], last = track[track.length - 1];
    return last && state.finished - last.time <= Math.max(0.25, 2.5 * period()) ? last : null;
  }
  const last = (at) => (tracks[at] && tracks[at].length ? tracks[at][tracks[at].length - 1] : null);

  /// The object that everything is about: the one asked for, else what docking goes by, as long as it is there.
  function choose() {
    if ($('object').value !== '') {
      chosen = Number($('object').value);
      return;
    }
    if (chosen >= 0 && recording && seen(chosen)) return;
    if (chosen >= 0 && !recording && state.frames && last(chosen) && state.finished - last(chosen).time < 3) return;
    let best = -1;
    const better = (a, b) => kRankOf[objects[a].kind] - kRankOf[objects[b].kind] || objects[b].size - objects[a].size || a - b;
    objects.forEach((object, i) => {
      if (seen(i) && (best < 0 || better(i, best) < 0)) best = i;
    });
    if (best >= 0) chosen = best;
  }

  // ---- what is shown ----

  function say(id, text) { if ($(id).textContent !== text) $(id).textContent = text; }
  function grade(id, name) {
    ['good', 'warn', 'bad'].forEach((one) => $(id).classList.toggle(one, one === name));
  }

  function showState() {
    const now = judge();
    if (now !== page && now === 'stale') note('data went stale');
    if (now !== page && page === 'stale' && now === 'live') note('data are live again');
    page = now;
    document.documentElement.dataset.state = page;
    say('pill', {connecting: 'Connecting', waiting: 'Waiting for a frame', live: 'Live', recording: 'Recording', stale: 'Stale', lost: 'No connection', ended: 'Ended'}[page]);
    const alarm = page === 'recording' && recording.lack ? ['NOT THE WHOLE FILE', () => recording.lack + '.'] : kAlarms[page], since = page === 'lost' ? stream.silence() : age();
    $('alarm').hidden = !alarm;
    $('alarm').classList.toggle('calm', page === 'ended' || page === 'recording');
    if (alarm) {
      say('alarm-title', alarm[0]);
      // Aloud once and then every few seconds, not with each tenth.
      if (berth.now() - spoken > 1 || $('alarm-text').textContent === '') {
        say('alarm-text', alarm[1](since));
        spoken = berth.now();
      }
    } else {
      say('alarm-text', '');
    }
  }

  function showGlance() {
    const sample = isShown() && chosen >= 0 ? seen(chosen) : null, name = chosen >= 0 ? objects[chosen].name : '';
    say('range', sample ? berth.measured(sample.range, sample.rangeDeviation, 4) : '—');
    say('range-sub', sample ? '± ' + berth.length(sample.rangeDeviation) : '\u00a0');
    const speed = sample && sample.closing !== null ? sample.closing * 1000 : null;
    say('closing-name', speed !== null && speed < 0 ? 'Drawing away' : 'Closing');
    say('closing', speed === null ? '—' : berth.fixed(Math.abs(speed), Math.abs(speed) < 100 ? 1 : 0));
    say('closing-sub', speed === null ? (sample ? 'takes half a second of poses' : '\u00a0') :
      '± ' + berth.fixed((sample.closingDeviation || 0) * 1000, 1) + ' mm/s' + (speed > 1 && speed > 2000 * (sample.closingDeviation || 0) ? ', ' + berth.duration(sample.range / (speed / 1000)) + ' left' : ''));
    showPose(sample, name);
    if (page === 'recording') {
      say('age', berth.fixed(recording.time, 2));
      say('age-unit', 's');
      say('age-sub', recording.frame && recording.frame.missed ? 'behind ' + berth.count(recording.frame.missed) + ' frames that were dropped' : 'from the first frame');
      grade('age-card', '');
      document.title = (sample ? berth.fixed(sample.range, 3) + ' m' : 'not seen') + ' at ' + berth.fixed(recording.time, 2) + ' s · Berth';
      return;
    }
    const old = page === 'lost' ? stream.silence() : age();
    const isSlow = old !== null && old >= 1;
    say('age', old === null || page === 'ended' ? '—' : isSlow ? berth.fixed(old, 1) : String(Math.round(old * 1000)));
    say('age-unit', isSlow ? 's' : 'ms');
    say('age-sub', old === null ? '\u00a0' : state.captured_known ? 'since mid-exposure' : 'since the frame was done');
    grade('age-card', page === 'live' ? '' : page === 'stale' || page === 'lost' ? 'bad' : '');
    document.title = (page === 'live' ? (sample ? berth.fixed(sample.range, 3) + ' m' : 'not seen') : $('pill').textContent.toUpperCase()) + ' · Berth';
  }

  function showPose(sample, name) {
    const before = chosen >= 0 ? last(chosen) : null;
    if (page === 'stale' || page === 'lost') {
      say('pose', page === 'stale' ? 'STALE' : 'UNKNOWN');
      say('pose-sub', 'no pose is shown');
      return grade('pose-card', 'bad');
    }
    if (!isShown() || (recording && !recording.frame)) {
      say('pose', '—');
      say('pose-sub', '\u00a0');
      return grade('pose-card', '');
    }
    if (!sample) {
      say('pose', 'NOT SEEN');
      say('pose-sub', recording ? recording.frame.wrong || 'not in this frame' : before ? name + ': last ' + berth.duration(state.finished - before.time) + ' ago' : 'no object has had a pose');
      return grade('pose-card', 'warn');
    }
    const isDoubtful = sample.ambiguity > 0.6;
    say('pose', isDoubtful ? 'AMBIGUOUS' : 'VALID');
    say('pose-sub', name + (isDoubtful ? ': tilted the other way it fits nearly as well' : sample.error === null ? '' : ', fits to ' + berth.fixed(sample.error, 2) + ' px'));
    grade('pose-card', isDoubtful ? 'warn' : 'good');
  }

  function showPlots() {
    const track = tracks[chosen] || [], sample = isShown() && chosen >= 0 ? seen(chosen) : null;
    say('plots-note', chosen < 0 ? '' : objects[chosen].name + (about.filtered ? ', closing speed filtered' : ''));
    if (recording) {
      plots.forEach((plot) => {
        plot.draw(track, 0, Math.max(1e-3, recording.length), recording.gap, berth.since, {cursor: recording.time});
        plot.read(sample);
      });
      scene.show(track, sample, chosen >= 0 ? objects[chosen].size : 0, recording.gap);
      return;
    }
    const span = Number($('span').value), to = page === 'ended' ? state.finished : stream.now();
    plots.forEach((plot) => {
      plot.draw(track, to - Math.min(span, kOldest), to, gap(), berth.ago);
      plot.read(sample);
    });
    scene.show(track, sample, chosen >= 0 ? objects[chosen].size : 0, gap());
  }

  function showCards() {
    const s = recording ? recording.frame : state;
    if (!s || (recording ? s.wrong : !s.frames)) return;
    say('mode', s.mode);
    say('search', s.search);
    say('why', s.why || 'markers are not followed (--track)');
    if (recording) return showRecorded(s);
    say('backend', about.backend && about.backend.startsWith(s.backend) ? about.backend : s.backend);
    say('frames', berth.count(s.frames) + ', ' + berth.fixed(100 * s.with_pose / s.frames, 1) + ' % with a pose');
    say('rate', page === 'live' ? berth.fixed(s.fps, 1) + ' frames/s' : '—');
    say('label', s.label);
    const p = s.pipeline;
    if (p) {
      const dropped = Object.entries(p.dropped).filter(([, n]) => n > 0);
      say('drops', berth.count(p.offered) + ' offered, ' + (dropped.length ? dropped.map(([why, n]) => berth.count(n) + ' dropped for ' + why).join(', ') : 'none dropped') +
        '; late: ' + p.late.map(berth.count).join(', '));
    } else {
      say('drops', 'Frame by frame: none is dropped.');
    }
    showHealth(s);
    showSeen();
  }

  /// What the recording says of this frame, and of all.
  function showRecorded(frame) {
    const whole = recording.times.length === recording.count;
    say('backend', frame.backend);
    say('frames', berth.count(frame.frame + 1) + ' of ' + berth.count(recording.count));
    say('rate', whole && recording.length > 0 ? berth.fixed((recording.count - 1) / recording.length, 1) + ' frames/s on average' : '—');
    say('label', frame.label);
    say('drops', 'This frame: ' + Object.entries(frame.times).filter(([, us]) => us > 0).map(([name, us]) => name + ' ' + berth.fixed(us / 1000, 2) + ' ms').join(', ') +
      '. Above: ' + (whole ? 'all of the recording.' : 'what was read so far.'));
    list('health', recording.lines());
    showSeen();
  }

  function showHealth(s) {
    const lines = [];
    const camera = s.camera, total = camera.lost + camera.incomplete + camera.repeated + camera.misdated;
    if (s.health.mode !== 'nominal') lines.push([s.valid ? 'warn' : 'bad', s.health.text + (s.health.reason ? ': ' + s.health.reason : '')]);
    if (s.health.known_answers) lines.push(['', berth.count(s.health.known_answers) + ' known answers, ' + s.health.wrong_answers + ' wrong']);
    if (s.health.recovery === 'trying') lines.push(['warn', 'the backend that was left is tried again, so far ' + s.health.tries + ' ×']);
    if (s.health.recovery === 'given up') lines.push(['warn', 'a backend was left too often and is not tried any more']);
    if (s.health.returns) lines.push(['', 'went back to a backend ' + s.health.returns + ' ×']);
    lines.push(s.status === 'device_lost' ? ['bad', 'the device is lost'] : ['', 'device: ' + s.backend]);
    lines.push(total ? ['warn', 'camera: ' + camera.lost + ' lost, ' + camera.incomplete + ' incomplete, ' + camera.repeated + ' repeated, ' + camera.misdated + ' with impossible times'] : ['', 'camera: no frame lost']);
    if (camera.reopened) lines.push(['warn', 'camera opened again ' + camera.reopened + ' ×']);
    if (camera.skipped) lines.push(['', berth.count(camera.skipped) + ' frames skipped for newer ones']);
    if (s.overflows) lines.push(['warn', 'lists ran full in ' + berth.count(s.overflows) + ' frames']);
    if (s.pipeline && s.pipeline.run_again) lines.push(['warn', berth.count(s.pipeline.run_again) + ' frames run again on another backend']);
    lines.push(['', 'viewers: ' + s.viewers.events + (s.viewers.refused ? ', ' + s.viewers.refused + ' turned away' : '')]);
    if (video.refused) lines.push(['warn', 'too many watch the video; trying again']);
    list('health', lines);
  }

  /// Lines of a grade and words, where they are others than before.
  function list(id, lines) {
    const text = JSON.stringify(lines);
    if ($(id).dataset.text === text) return;
    $(id).dataset.text = text;
    $(id).replaceChildren(...lines.map(([name, words]) => {
      const item = document.createElement('li');
      item.className = name;
      item.textContent = words;
      return item;
    }));
  }

  function showSeen() {
    $('seen').replaceChildren(...objects.map((object, i) => {
      const row = document.createElement('tr'), sample = isShown() ? seen(i) : null, before = recording ? null : last(i);
      row.className = i === chosen ? 'chosen' : '';
      [object.name, sample ? berth.measured(sample.range, sample.rangeDeviation, 4) : '—', sample ? berth.fixed(sample.error, 2) : '—',
        sample ? 'now' : before && page !== 'lost' ? berth.duration(state.finished - before.time) + ' ago' : '—'].forEach((text) => { row.insertCell().textContent = text; });
      return row;
    }));
  }

  function showTimes(rows) {
    $('times').replaceChildren(...rows.map((row) => {
      const line = document.createElement('tr');
      row.forEach((cell, i) => { line.insertCell().textContent = i === 0 ? cell : berth.fixed(cell, cell < 10 ? 2 : 1); });
      return line;
    }));
  }

  function showVideo() {
    video.overlay = $('overlay-on').checked;
    if (recording) {
      say('video-note', video.picture ? video.picture.about.width + ' × ' + video.picture.about.height : '');
      return video.draw(page === 'recording', null);
    }
    if (!$('video-on').checked) say('video-note', 'off');
    else if (!video.picture) say('video-note', '');
    const picture = video.picture, old = picture ? Math.max(0, stream.now() - picture.about.captured) : null;
    const isLive = page === 'live' && $('video-on').checked && old !== null && old <= limit() + 0.5;
    if (picture && $('video-on').checked) say('video-note', picture.about.width + ' × ' + picture.about.height + (isLive ? ', ' + Math.round(old * 1000) + ' ms old' : ''));
    video.draw(isLive, old);
  }

  function tick() {
    showState();
    if (!state || document.hidden) return;
    choose();
    showGlance();
    if (video.fresh || page !== 'live' || berth.now() - drawn > 0.25) {
      video.fresh = false;
      showVideo();
    }
    if (berth.now() - drawn < 0.09) return;
    drawn = berth.now();
    // Nothing of a recording moves by itself.
    if (!recording || berth.now() - plotted > 0.5) {
      plotted = drawn;
      showPlots();
    }
    scene.draw();
    if (berth.now() - listed < 0.4) return;
    listed = berth.now();
    showCards();
  }

  // ---- what people do ----

  berth.theme($('theme'), () => scene.colours());
  $('clear').addEventListener('click', () => {
    tracks = tracks.map(() => []);
    scene.clear();
  });
  $('video-on').addEventListener('change', watch);
  document.addEventListener('visibilitychange', watch);
  $('control-form').addEventListener('submit', async (event) => {
    event.preventDefault();
    const button = $('end-run');
    if (!button.classList.contains('sure')) {
      button.classList.add('sure');
      button.textContent = 'Press again to end it';
      setTimeout(() => {
        button.classList.remove('sure');
        button.textContent = 'End the run';
      }, 4000);
      return;
    }
    try {
      const answer = await fetch('control', {method: 'POST', headers: {Authorization: 'Bearer ' + $('token').value, 'Content-Type': 'application/json'}, body: '{"do":"end"}'});
      say('control-note', (await answer.text()).trim());
    } catch (e) {
      say('control-note', 'Berth did not answer.');
    }
  });
  setInterval(tick, 50);
})(window.berth);
