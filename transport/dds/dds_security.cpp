// Checks of DDS Security files that Cyclone does not make.
// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include "takt/base/error.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {
namespace {

constexpr const char* kKey = "private key";
constexpr const char* kCertificate = "certificate";

template <auto Free>
struct Deleter {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using File = std::unique_ptr<BIO, Deleter<BIO_free>>;
using Certificate = std::unique_ptr<X509, Deleter<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY_free>>;

// Without a password callback, OpenSSL would ask on the terminal.
int no_password(char*, int, int, void*) {
  return -1;
}

// Parses the file with `read`, a function of OpenSSL.
template <class Object, class Read>
Object read_pem(const std::string& path, const char* what, Read read) {
  ERR_clear_error();
  const File file(BIO_new_file(path.c_str(), "r"));
  Object object(file != nullptr ? read(file.get(), nullptr, no_password, nullptr) : nullptr);
  const char* const reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  if (object != nullptr) return object;
  throw Error(fmt::format("the {} '{}' cannot be read: {}", what, path,
                          reason != nullptr ? reason : "OpenSSL does not say why"),
              fmt::format("name a {} in PEM form, without a password", what));
}

}  // namespace

void DdsSecurity::check() const {
  struct stat file {};
  if (stat(private_key.c_str(), &file) != 0) {
    throw Error(
        fmt::format("the {} '{}' cannot be read: {}", kKey, private_key, std::strerror(errno)),
        "name a file that is there");
  }
  if ((file.st_mode & (S_IROTH | S_IWOTH)) != 0) {
    throw Error(
        fmt::format("the {} '{}' is open to every user of this machine: its mode is {:04o}", kKey,
                    private_key, file.st_mode & 07777),
        fmt::format("chmod 600 {}, and make a new one if others could read it", private_key));
  }
  const Key key = read_pem<Key>(private_key, kKey, PEM_read_bio_PrivateKey);
  const Certificate own = read_pem<Certificate>(certificate, kCertificate, PEM_read_bio_X509);
  const bool fits = X509_check_private_key(own.get(), key.get()) == 1;
  ERR_clear_error();
  if (!fits) {
    throw Error(fmt::format("the {} '{}' is not that of the {} '{}'", kKey, private_key,
                            kCertificate, certificate),
                "name the two that were made together");
  }
}

}  // namespace takt
