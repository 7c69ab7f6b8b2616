/** A WebSocket that is opened, and asked, while the page's program is still read: what it says is kept until then. */

import type { Socket } from './socket';

export class HeldSocket implements Socket {
  onopen: Socket['onopen'] = null;
  onclose: Socket['onclose'] = null;
  onmessage: Socket['onmessage'] = null;
  private held: (() => void)[] | null = [];

  /** `first`: what is sent as soon as it is open. */
  constructor(
    private readonly socket: Socket,
    private first: string | null,
  ) {
    socket.onopen = (event) => {
      if (this.first !== null) socket.send(this.first);
      this.tell(() => this.onopen?.(event));
    };
    socket.onmessage = (event) => this.tell(() => this.onmessage?.(event));
    socket.onclose = (event) => this.tell(() => this.onclose?.(event));
  }

  heed(): void {
    const held = this.held ?? [];
    this.held = null;
    for (const call of held) call();
  }

  /** What was sent already is not sent again. */
  send(text: string): void {
    if (text !== this.first) this.socket.send(text);
    this.first = null;
  }

  close(): void {
    this.socket.close();
  }

  private tell(call: () => void): void {
    if (this.held === null) call();
    else this.held.push(call);
  }
}
