// One key, one file.
#pragma once

#include <string>

#include "common/base/result.h"
#include "common/net/keys.h"

namespace gapfarm {

// Errors: missing, another user's, readable for others, a link, no key pair in it.
Result<KeyPair> read_key_pair(const std::string& path);

// These make a new file (0600, 0644) whole or not at all.  Error: it exists with another key.
Status write_key_pair(const std::string& path, const KeyPair& pair);
Status write_public_key(const std::string& path, const PublicKey& key);

}  // namespace gapfarm
