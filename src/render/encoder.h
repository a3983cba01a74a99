// H.264 movies by ffmpeg, a process of its own that is fed raw frames.
#pragma once

#include <string>
#include <sys/types.h>

#include "render/picture.h"

namespace assay {

class Encoder {
 public:
  // Starts ffmpeg (of the PATH), which writes `path` in the MP4 container. `frame_ms` is the time from one frame to the
  // next. Throws SystemError when there is no ffmpeg, saying what to install.
  Encoder(const std::string& path, int width, int height, double frame_ms);
  ~Encoder();  // ends ffmpeg when finish() was not called
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  // Of the size given above; both even. Throws SystemError with ffmpeg's own words when it has failed.
  void write(const Picture& picture);

  // Waits until the file is complete. Throws SystemError.
  void finish();

 private:
  [[noreturn]] void fail();
  int wait();

  std::string path_;
  int frames_ = -1, words_ = -1;  // ffmpeg's standard input and error
  pid_t pid_ = -1;
};

}  // namespace assay
