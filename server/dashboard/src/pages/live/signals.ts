/** What the signals of a joint are called. */

import type { Signal } from '../../lib/live/recording';

export const SIGNAL_NAMES: Readonly<Record<Signal, string>> = {
  set_point: 'Set point',
  position: 'Position',
  error: 'Error',
  drive: 'Drive',
};
