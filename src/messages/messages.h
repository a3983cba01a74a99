// What the coordinator and its workers say to each other.
#pragma once

namespace assay {

// The descriptor on which a worker finds its socket.
inline constexpr int kWorkerSocket = 3;

}  // namespace assay
