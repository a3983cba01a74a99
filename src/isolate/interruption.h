// Ctrl-C and SIGTERM as a flag, for work that ends in order.
#pragma once

namespace assay {

// From now on SIGINT and SIGTERM only set the flag that interrupted() returns; with `once`, a second one
// that comes later than the same signal sent to the whole process group ends the program.
void watch_for_interruption(bool once = true);
bool interrupted();

}  // namespace assay
