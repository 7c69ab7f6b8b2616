/**
 * When something that was loaded is loaded again: soon after a change, several changes together, and at once when the
 * connection has come back, since what happened meanwhile is not told later.
 */

export interface ReloadParts {
  load(): void;
  after(seconds: number, call: () => void): () => void;
}

export class Reload {
  private healed: number | null = null;
  private cancelTimer: () => void = () => {};

  constructor(private readonly parts: ReloadParts) {}

  soon(seconds: number): void {
    this.leave();
    this.cancelTimer = this.parts.after(seconds, () => this.parts.load());
  }

  /** Nothing is loaded any more of what has changed until now. */
  leave(): void {
    this.cancelTimer();
  }

  /** How often the connection has come back since the page was opened (`live.healed`): for an effect that follows it. */
  afterHealing(times: number): void {
    const missed = this.healed !== null && times > this.healed;
    this.healed = times;
    if (!missed) return;
    this.leave();
    this.parts.load();
  }
}

/** A timer of the browser. Returns what stops it. */
export function afterSeconds(seconds: number, call: () => void): () => void {
  const timer = setTimeout(call, seconds * 1000);
  return () => clearTimeout(timer);
}
