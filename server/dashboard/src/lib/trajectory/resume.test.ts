import { describe, expect, it } from 'vitest';
import { resumeHindrance } from './resume';

describe('a queue', () => {
  it('is not resumed while the arm needs a reset', () => {
    expect(resumeHindrance('stopped')).toMatch(/stopped.*reset/);
    expect(resumeHindrance('fault')).toMatch(/fault.*reset/);
  });

  it('is resumed otherwise', () => {
    for (const arm of ['disconnected', 'idle', 'armed', 'running', undefined] as const)
      expect(resumeHindrance(arm)).toBe('');
  });
});
