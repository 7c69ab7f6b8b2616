/**
 * The live WebSocket: opens, and comes back by itself when it is lost.
 *
 * Knows nothing about a browser: what opens sockets and tells the time is handed in.
 */

import type { LiveFrame, LiveRequest } from './types';

/** s that are waited before the next attempt: short first, since most losses are a service that restarts. */
export const BACK_OFF = [0.25, 0.5, 1, 2, 3] as const;
/** s without a frame after which the service is asked whether it is there. */
export const SILENT_AFTER = 1.5;
/** s that it has to answer. */
export const ANSWER_WITHIN = 1.5;
/** s for a connection to open. */
export const OPEN_WITHIN = 6;

export type SocketState =
  | { phase: 'connecting'; attempt: number }
  /** `again`: it was open before, so that something may have been missed. */
  | { phase: 'open'; again: boolean }
  | { phase: 'lost'; attempt: number; why: string; retryAt: number };

/** The part of a WebSocket that is used. */
export interface Socket {
  onopen: ((event: Event) => void) | null;
  onclose: ((event: CloseEvent) => void) | null;
  onmessage: ((event: MessageEvent<string>) => void) | null;
  send(text: string): void;
  close(): void;
  /** Calls back from now on, first with what has happened already. */
  listen(): void;
}

export interface SocketParts {
  open(): Promise<Socket>;
  frame(frame: LiveFrame, at: number): void;
  state(state: SocketState): void;
  /** s, of a clock that only goes forward. */
  now(): number;
  after(seconds: number, call: () => void): () => void;
}

/** s before attempt `attempt` (from 1). */
export function backOff(attempt: number): number {
  return BACK_OFF[Math.min(attempt, BACK_OFF.length) - 1] ?? 3;
}

/**
 * Whether the connection is missing: also while it is being tried again. Only the very first attempt, before anything was
 * heard, has a moment.
 */
export function isMissing(state: SocketState, hasHeard: boolean): boolean {
  if (state.phase === 'open') return false;
  return state.phase === 'lost' || state.attempt > 1 || hasHeard;
}

export class LiveSocket {
  private socket: Socket | null = null;
  private isOpen = false;
  private attempt = 0;
  private heard = 0;
  /** Grows with every connection: what belongs to an earlier one is not listened to. */
  private turn = 0;
  private cancelTimer: () => void = () => {};
  private ended = false;
  private wasOpen = false;

  constructor(private readonly parts: SocketParts) {}

  start(): void {
    this.ended = false;
    void this.connect();
  }

  end(): void {
    this.ended = true;
    this.leave();
  }

  /** Tries at once, without waiting for the next attempt. */
  retryNow(): void {
    if (this.isOpen || this.ended) return;
    this.leave();
    void this.connect();
  }

  /** Sends, where it is open. Whether it was. */
  send(request: LiveRequest): boolean {
    if (this.socket === null || !this.isOpen) return false;
    this.socket.send(JSON.stringify(request));
    return true;
  }

  private async connect(): Promise<void> {
    const turn = ++this.turn;
    this.attempt += 1;
    this.parts.state({ phase: 'connecting', attempt: this.attempt });
    this.timer(OPEN_WITHIN, () => this.lost('the service does not answer'));
    let socket: Socket;
    try {
      socket = await this.parts.open();
    } catch (error) {
      if (turn === this.turn) this.lost(error instanceof Error ? error.message : String(error));
      return;
    }
    if (turn !== this.turn) return socket.close();
    this.socket = socket;
    socket.onopen = () => {
      if (turn !== this.turn) return;
      this.isOpen = true;
      this.attempt = 0;
      this.heard = this.parts.now();
      this.parts.state({ phase: 'open', again: this.wasOpen });
      this.wasOpen = true;
      this.listen();
    };
    socket.onmessage = (event) => {
      if (turn !== this.turn) return;
      this.heard = this.parts.now();
      // When it came, which may be long before it can be heard: ages are told from it.
      this.parts.frame(JSON.parse(event.data) as LiveFrame, event.timeStamp / 1000);
    };
    socket.onclose = (event) => {
      if (turn === this.turn) this.lost(event.reason || 'the connection was closed');
    };
    socket.listen();
  }

  /** A connection can be dead without being closed: after some silence the service is asked for something small. */
  private listen(): void {
    const silent = this.parts.now() - this.heard;
    if (silent < SILENT_AFTER) {
      this.timer(SILENT_AFTER - silent, () => this.listen());
      return;
    }
    const before = this.heard;
    this.send({ history: 0, points: 10 });
    this.timer(ANSWER_WITHIN, () => {
      if (this.heard === before) this.lost('the service has gone silent');
      else this.listen();
    });
  }

  private lost(why: string): void {
    this.leave();
    if (this.ended) return;
    const wait = backOff(Math.max(1, this.attempt));
    const state = { phase: 'lost', attempt: this.attempt, why, retryAt: this.parts.now() + wait } as const;
    this.parts.state(state);
    this.timer(wait, () => void this.connect());
  }

  private leave(): void {
    this.turn += 1;
    this.cancelTimer();
    this.isOpen = false;
    const socket = this.socket;
    this.socket = null;
    if (socket !== null) {
      socket.onopen = socket.onclose = socket.onmessage = null;
      socket.close();
    }
  }

  private timer(seconds: number, call: () => void): void {
    this.cancelTimer();
    this.cancelTimer = this.parts.after(seconds, call);
  }
}
