/** A WebSocket that is opened before whoever listens to it is there: what it says until then is heard then. */

import type { Socket } from './socket';

export class EarlySocket implements Socket {
  onopen: Socket['onopen'] = null;
  onclose: Socket['onclose'] = null;
  onmessage: Socket['onmessage'] = null;
  /** What was not heard yet; null once somebody listens. */
  private kept: (() => void)[] | null = [];

  /** `first`: is sent as soon as it has opened. */
  constructor(
    private readonly socket: Omit<Socket, 'listen'>,
    first: string,
  ) {
    socket.onopen = (event) => {
      socket.send(first);
      this.hear(() => this.onopen?.(event));
    };
    socket.onmessage = (event) => this.hear(() => this.onmessage?.(event));
    socket.onclose = (event) => this.hear(() => this.onclose?.(event));
  }

  /** Calls back from now on, first with what has been kept. */
  listen(): void {
    const kept = this.kept ?? [];
    this.kept = null;
    for (const call of kept) call();
  }

  send(text: string): void {
    this.socket.send(text);
  }

  close(): void {
    this.socket.close();
  }

  private hear(call: () => void): void {
    if (this.kept === null) call();
    else this.kept.push(call);
  }
}
