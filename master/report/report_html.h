// The diagnosis as one self-contained page: no network, its own scripts and styles only.
#pragma once

#include <string>

#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// The whole file, UTF-8.  It holds the diagnosis as JSON too (see script_safe() for how), plots it
// with scripts whose hashes its content security policy names, and reads as text without them.
// The same diagnosis gives the same bytes.
// `served`: by `gapfarm serve`.
std::string report_html(const Diagnosis& diagnosis, bool served = false);

}  // namespace gapfarm
