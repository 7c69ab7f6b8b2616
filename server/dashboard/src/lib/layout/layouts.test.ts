import { beforeEach, expect, it, vi } from 'vitest';
import { layouts, type Keeper } from './layouts.svelte';
import { STANDARD } from './layout';

const kept = new Map<string, string>();

beforeEach(() => {
  kept.clear();
  vi.useFakeTimers();
  vi.stubGlobal('localStorage', {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, value: string) => kept.set(key, value),
    removeItem: (key: string) => kept.delete(key),
  });
  return () => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  };
});

function keeper(text: string | null): Keeper & { put: ReturnType<typeof vi.fn> } {
  return { get: () => Promise.resolve(text), put: vi.fn(() => Promise.resolve()) };
}

const bench = { ...STANDARD, name: 'Bench' };

it('what is saved is shown, kept here at once, and told to the service when it is quiet', async () => {
  const service = keeper(null);
  layouts.follow('ada', service);
  layouts.save(bench, null);
  layouts.save(bench, null);
  expect(layouts.own.map((one) => one.name)).toEqual(['Bench', 'Bench 2']);
  expect(layouts.shown.name).toBe('Bench 2');
  expect(kept.get('ma2000-layouts:ada')).toContain('Bench 2');
  await vi.advanceTimersByTimeAsync(2000);
  expect(service.put.mock.calls).toEqual([[kept.get('ma2000-layouts:ada'), 'Bench 2']]);
  layouts.follow('bob', keeper(null));
  expect(layouts.shown).toBe(STANDARD);
});

it('on another computer the service has them; without the service this browser has', async () => {
  layouts.follow('carl', keeper(null));
  layouts.save(bench, null);
  await vi.advanceTimersByTimeAsync(2000);
  const text = kept.get('ma2000-layouts:carl')!;
  kept.clear();
  layouts.follow('dora', keeper(text));
  await vi.advanceTimersByTimeAsync(0);
  expect(layouts.shown.name).toBe('Bench');
  expect(kept.get('ma2000-layouts:dora')).toBe(text);
  kept.set('ma2000-layouts:emma', text);
  layouts.follow('emma', { ...keeper(null), get: () => Promise.reject(new Error('no connection')) });
  await vi.advanceTimersByTimeAsync(0);
  expect(layouts.shown.name).toBe('Bench');
});

it('what was changed and not told yet is told, and not lost, when the page is opened again', async () => {
  layouts.follow('gil', keeper(null));
  layouts.save(bench, null);
  const [text, untold] = [kept.get('ma2000-layouts:gil')!, kept.get('ma2000-layouts:gil:untold')];
  expect(untold).toBe('yes');
  kept.set('ma2000-layouts:hal', text);
  kept.set('ma2000-layouts:hal:untold', 'yes');
  const service = keeper('{}');
  layouts.follow('hal', service);
  await vi.advanceTimersByTimeAsync(0);
  expect(layouts.shown.name).toBe('Bench');
  expect(service.put.mock.calls).toEqual([[text, 'Bench']]);
  expect(kept.has('ma2000-layouts:hal:untold')).toBe(false);
});

it('what cannot be read is said in one line, and the standard is shown', () => {
  kept.set('ma2000-layouts:fay', '{"layouts":[{"format":"other"}]}');
  layouts.follow('fay', keeper(null));
  expect(layouts.problem).toContain('its "format" has to be');
  expect(layouts.shown).toBe(STANDARD);
});
