import { expect, it } from 'vitest';
import { isOld, whyOld } from './age';

it('an old picture has its cause: the camera, the service, or what the service says of it', () => {
  expect([isOld(0.4), isOld(46), isOld(NaN)]).toEqual([false, true, true]);
  expect(whyOld('no answer from the camera', 0)).toBe('no answer from the camera');
  expect(whyOld('', 5)).toBe('the service has not answered yet');
  expect(whyOld('', 0.1)).toBe('the camera has sent no newer picture');
});
