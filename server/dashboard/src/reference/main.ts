/** The reference of the API, made from the service's own description. It reads and asks nothing of other computers. */

import SwaggerUI from 'swagger-ui-dist/swagger-ui-es-bundle.js';
import 'swagger-ui-dist/swagger-ui.css';
import '@fontsource-variable/inter/wght.css';
import './reference.css';
import { currentToken } from '../lib/api/token';
import { theme } from '../lib/theme.svelte';
import { METHODS_TO_TRY, withToken } from './settings';

theme.start((shown) => document.documentElement.classList.toggle('dark-mode', shown === 'dark'));
SwaggerUI({
  dom_id: '#reference',
  url: 'api/v1/openapi.json',
  // Closed tags: a hundred operations drawn at once hold a slow computer up for seconds.
  docExpansion: 'none',
  defaultModelsExpandDepth: 0,
  filter: true,
  supportedSubmitMethods: METHODS_TO_TRY,
  requestInterceptor: (request) => withToken(request, currentToken(), location.origin),
  // The checker of swagger.io would be asked across the network.
  validatorUrl: null,
});
