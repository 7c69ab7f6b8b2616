/** Which joints of a trace were told to go one way in one go: those of which rise time and overshoot say something. */

import { columnOf, type Signals } from '../traces/columns';
import { goesOneWay } from './measures';

export function jointsThatStep(signals: Signals): number[] {
  return signals.joints.filter((joint) => {
    const setPoint = columnOf(signals, 'set_point', joint);
    return setPoint !== null && goesOneWay(signals.time, setPoint);
  });
}
