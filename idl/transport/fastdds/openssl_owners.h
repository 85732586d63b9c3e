#pragma once
// Owners of objects of OpenSSL.
#include <openssl/bio.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <memory>

namespace takt::openssl {

template <auto Free>
struct Freed {
  template <typename Object>
  void operator()(Object* object) const {
    Free(object);
  }
};
using Bio = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Signed = std::unique_ptr<PKCS7, Freed<PKCS7_free>>;
using Store = std::unique_ptr<X509_STORE, Freed<X509_STORE_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;

}  // namespace takt::openssl
