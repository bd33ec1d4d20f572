// The keys of a farm and the folder that holds them (docs/security.md).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

// Keys are CURVE's (Curve25519), 32 bytes written as 40 characters of Z85.
struct PublicKey {
  std::string name;  // 1 to 64 of A-Z a-z 0-9 . _ -, beginning with a letter or digit
  std::string key;
};

struct KeyPair {
  std::string name;
  std::string public_key;
  std::string secret_key;
};

enum class OpenLinks { kNever, kLoopback, kAnywhere };

// How one side of a tcp:// link protects itself.  As it is by default, no tcp:// link is made.
struct LinkSecurity {
  OpenLinks open = OpenLinks::kNever;  // neither encrypted nor authenticated; outranks the keys
  std::optional<KeyPair> own;
  std::string master_key;  // the worker's side: public key of the only master it talks to
  std::string listed;      // the master's side: folder of the workers' public keys, *.pub
};

bool is_key_name(std::string_view name);
KeyPair make_key_pair(const std::string& name);

// A public key file.  Errors: cannot be read, no key in it, writable for other users.
Result<PublicKey> read_public_key(const std::string& path);
// All *.pub of a folder, by name.  What cannot be read is omitted and described in `trouble`.
Result<std::vector<PublicKey>> read_listed_keys(const std::string& folder,
                                                std::vector<std::string>* trouble);

// Files of a key folder (0700): master.key and worker.key are secret (0600), master.pub,
// worker.pub and workers/NAME.pub are not.  Everything is refused that another user could read or
// change.
class KeyFolder {
 public:
  // ~/.config/gapfarm/keys, or that under $XDG_CONFIG_HOME.
  static std::string default_path();
  // Errors: missing, another user's, open to others.
  static Result<KeyFolder> open(const std::string& path);
  // Makes it when it is missing.
  static Result<KeyFolder> open_or_make(const std::string& path);

  const std::string& path() const { return path_; }
  std::string listed_path() const { return path_ + "/workers"; }

  // `role`: "master" or "worker".
  bool has_pair(const std::string& role) const;
  Result<KeyPair> pair(const std::string& role) const;
  // Both files of it.  Never replaces a key.
  Status add_pair(const std::string& role, const KeyPair& pair) const;

  // Of the master that this folder's worker belongs to.
  Result<PublicKey> master_public() const;
  Status add_master_public(const PublicKey& key) const;

  // The workers that this folder's master lets in.
  Result<std::vector<PublicKey>> listed(std::vector<std::string>* trouble) const;
  // Error: the name is taken by another key.
  Status list(const PublicKey& key) const;
  Status unlist(const std::string& name) const;

 private:
  explicit KeyFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

// What `gapfarm --keys FOLDER` and `gapfarm-worker --keys FOLDER` need of the folder.  Errors name
// what is missing and the command that makes it.
Result<LinkSecurity> master_security(const std::string& folder);
Result<LinkSecurity> worker_security(const std::string& folder);

}  // namespace gapfarm
