import '@fontsource-variable/inter/wght.css';
import './app.css';
import { askEarly } from './lib/live/asked';

askEarly();
void import('./app');
