// The server's events: a connection that comes back by itself, and the server's clock.
'use strict';
(function (berth) {
  const kSilent = 2.0;        // s without an event (four come a second at least): the connection is dead
  const kFirstWait = 0.5, kLongestWait = 5;

  class Stream {
    /// `on.about`, `on.state`, `on.connection(isThere, why)`
    constructor(url, on) {
      this.url = url;
      this.on = on;
      this.offset = null;
      this.run = null;
      this.heard = 0;
      this.wait = kFirstWait;
      this.connected = false;
      setInterval(() => this.watch(), 250);
      this.open();
    }

    open() {
      this.opened = berth.now();
      this.source = new EventSource(this.url);
      this.source.addEventListener('about', (event) => {
        const about = JSON.parse(event.data);
        if (about.run !== this.run) this.offset = null;  // another clock
        this.run = about.run;
        this.on.about(about);
      });
      this.source.addEventListener('state', (event) => this.take(JSON.parse(event.data)));
      this.source.addEventListener('error', () => this.lose());
    }

    take(state) {
      const now = berth.now();
      this.heard = now;
      this.wait = kFirstWait;
      // Events are late by at least the way here: the least difference seen is the nearest to none. It may grow again,
      // slowly, since two clocks never agree for long.
      const difference = now - state.now;
      this.offset = this.offset === null || difference < this.offset ? difference : this.offset + 1e-5;
      if (!this.connected) {
        this.connected = true;
        this.on.connection(true);
      }
      this.on.state(state);
    }

    /// The server's time now, s.
    now() { return this.offset === null ? 0 : berth.now() - this.offset; }
    /// Since the last event, s.
    silence() { return berth.now() - this.heard; }

    watch() {
      if (this.source && berth.now() - Math.max(this.heard, this.opened) > kSilent) this.lose();
    }

    lose() {
      if (!this.source) return;
      this.source.close();
      this.source = null;
      this.connected = false;
      this.on.connection(false);
      setTimeout(() => this.open(), this.wait * 1000);
      this.wait = Math.min(kLongestWait, this.wait * 1.6);
    }
  }

  berth.now = () => performance.now() / 1000;
  berth.Stream = Stream;
})(window.berth);
