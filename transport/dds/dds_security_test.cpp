// Keys and certificates that do not go together, or are open to all.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include "takt/base/error.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class DdsSecurityTest : public testing::Test {
 protected:
  DdsSecurityTest() {
    if (mkdtemp(folder_.data()) == nullptr) ADD_FAILURE() << "no directory " << folder_;
    make("one");
    make("other");
  }
  ~DdsSecurityTest() override { fs::remove_all(folder_); }

  // NAME.key and NAME.pem, which fit each other.
  void make(const std::string& name) const {
    const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"),
                                                                  EVP_PKEY_free);
    const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
    X509_gmtime_adj(X509_getm_notBefore(certificate.get()), 0);
    X509_gmtime_adj(X509_getm_notAfter(certificate.get()), 3600);
    X509_set_pubkey(certificate.get(), key.get());
    X509_sign(certificate.get(), key.get(), EVP_sha256());
    write(name + ".pem", [&](FILE* file) { PEM_write_X509(file, certificate.get()); });
    write(name + ".key", [&](FILE* file) {
      PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
    });
    write(name + "_locked.key", [&](FILE* file) {
      char password[] = "x";
      PEM_write_PrivateKey(file, key.get(), EVP_aes_128_cbc(), nullptr, 0, nullptr, password);
    });
  }
  template <class Write>
  void write(const std::string& name, Write write_to) const {
    FILE* const file = std::fopen(path(name).c_str(), "w");
    write_to(file);
    std::fclose(file);
    chmod(path(name).c_str(), 0600);
  }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string error_of(const std::string& certificate, const std::string& key) const {
    try {
      DdsSecurity{.certificate = path(certificate), .private_key = path(key)}.check();
      return "no error";
    } catch (const Error& error) {
      return error.what();
    }
  }

  std::string folder_ = testing::TempDir() + "takt_XXXXXX";
};

TEST_F(DdsSecurityTest, AKeyFitsItsCertificateOnly) {
  EXPECT_EQ(error_of("one.pem", "one.key"), "no error");
  EXPECT_EQ(error_of("one.pem", "other.key"),
            "the private key '" + path("other.key") + "' is not that of the certificate '" +
                path("one.pem") + "'; name the two that were made together");
}

TEST_F(DdsSecurityTest, AKeyIsForItsOwnerAndItsGroup) {
  for (const mode_t mode : {0600u, 0400u, 0640u, 0660u}) {
    chmod(path("one.key").c_str(), mode);
    EXPECT_EQ(error_of("one.pem", "one.key"), "no error") << std::oct << mode;
  }
  for (const mode_t mode : {0644u, 0604u, 0602u, 0666u}) {
    chmod(path("one.key").c_str(), mode);
    EXPECT_THAT(error_of("one.pem", "one.key"),
                AllOf(HasSubstr("is open to every user of this machine: its mode is 06"),
                      HasSubstr("; chmod 600 " + path("one.key"))));
  }
}

TEST_F(DdsSecurityTest, ThatCannotBeReadIsRefusedWithTheReason) {
  EXPECT_EQ(error_of("one.pem", "no.key"),
            "the private key '" + path("no.key") +
                "' cannot be read: No such file or directory; name a file that is there");
  EXPECT_THAT(error_of("one.key", "one.key"),
              StartsWith("the certificate '" + path("one.key") + "' cannot be read: "));
  EXPECT_THAT(error_of("one.pem", "one.pem"),
              StartsWith("the private key '" + path("one.pem") + "' cannot be read: "));
  // And nobody is asked for the password.
  EXPECT_THAT(error_of("one.pem", "one_locked.key"),
              AllOf(StartsWith("the private key '" + path("one_locked.key") + "' cannot be read: "),
                    HasSubstr("without a password")));
}

TEST_F(DdsSecurityTest, IsCheckedBeforeTheDomainIsJoined) {
  DdsOptions options;
  options.security = {.certificate = path("one.pem"), .private_key = path("other.key")};
  try {
    Participant::create(options);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("is not that of the certificate"));
  }
}

}  // namespace
}  // namespace takt
