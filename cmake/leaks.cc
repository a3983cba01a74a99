// What libraries that are not ours keep until the process ends: LeakSanitizer's suppressions, in the program because
// confined workers cannot read a file of them.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier): the sanitizer's name
  return "leak:libOSMesa\nleak:libfontconfig\nleak:libpython\n";
}
