// Movies by ffmpeg, which runs as a process and reads raw frames: H.264, or GIF for pages that show no video.
#pragma once

#include <string>
#include <sys/types.h>

#include "isolate/child.h"
#include "report/render/picture.h"

namespace assay {

class Encoder {
 public:
  enum class Format { kMp4, kGif };
  // Starts ffmpeg (of the PATH), which writes `path` as `format`. `frame_ms` is the time from one frame to the next; a
  // GIF has at most 15 frames a second. Throws SystemError, naming what to install, when there is no ffmpeg.
  Encoder(const std::string& path, Format format, int width, int height, double frame_ms);
  ~Encoder();  // ends ffmpeg when finish() was not called
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  // A frame of the size given above; width and height are even. Throws SystemError with ffmpeg's message on failure.
  void write(const Picture& picture);

  // Waits until the file is complete. Throws SystemError.
  void finish();

 private:
  [[noreturn]] void fail();
  int wait();

  std::string path_;
  Descriptor frames_, words_;  // ffmpeg's standard input and error
  pid_t pid_ = -1;
};

}  // namespace assay
