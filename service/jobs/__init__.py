"""Long work as folders in the store: parts, batches of parts, and the engines that compute them."""
