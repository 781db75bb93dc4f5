// For libraries that wait for ever, or abort, when a thread of theirs cannot be started.
#pragma once

namespace ruedo {

// Throw std::system_error, as std::thread does, unless so many threads can be started at once.
void require_threads(int count);
void require_threads_for_cores(int more);  // one for each core, and so many more

}  // namespace ruedo
