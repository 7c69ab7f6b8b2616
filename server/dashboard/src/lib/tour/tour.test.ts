import { expect, it } from 'vitest';
import { isWelcome, STOPS, type Visit } from './tour';

const first: Visit = { wasSeen: false, isMock: true, page: 'live', isBusy: false };

it('comes by itself once, on the Live page of a mock at rest', () => {
  expect(isWelcome(first)).toBe(true);
  expect(isWelcome({ ...first, page: '' })).toBe(true);
  for (const other of [{ wasSeen: true }, { isMock: false }, { page: 'traces' }, { isBusy: true }])
    expect(isWelcome({ ...first, ...other })).toBe(false);
});

it('leads to the demonstration, in a minute of reading', () => {
  expect(STOPS.at(-1)!.about).toContain('/diagnosis/hide');
  const words = STOPS.flatMap(({ title, text }) => `${title} ${text}`.split(' '));
  expect(words.length / 3.3).toBeLessThan(60); // 200 words a minute
});
