import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { afterSeconds, Reload } from './reload';

let load: ReturnType<typeof vi.fn<() => void>>;
let reload: Reload;

beforeEach(() => {
  vi.useFakeTimers();
  load = vi.fn();
  reload = new Reload({ load, after: afterSeconds });
});
afterEach(() => vi.useRealTimers());

describe('what was loaded', () => {
  it('is loaded once for several changes', () => {
    reload.soon(0.2);
    vi.advanceTimersByTime(100);
    reload.soon(0.2);
    vi.advanceTimersByTime(199);
    expect(load).not.toHaveBeenCalled();
    vi.advanceTimersByTime(1);
    expect(load).toHaveBeenCalledTimes(1);
  });

  it('is loaded at once, and once, every time the connection has come back', () => {
    reload.afterHealing(2);
    expect(load).not.toHaveBeenCalled();
    reload.soon(0.2);
    reload.afterHealing(3);
    expect(load).toHaveBeenCalledTimes(1);
    vi.advanceTimersByTime(1000);
    reload.afterHealing(3);
    expect(load).toHaveBeenCalledTimes(1);
    reload.afterHealing(4);
    expect(load).toHaveBeenCalledTimes(2);
  });

  it('is not loaded once nobody looks at it', () => {
    reload.soon(0.2);
    reload.leave();
    vi.advanceTimersByTime(1000);
    expect(load).not.toHaveBeenCalled();
  });
});
