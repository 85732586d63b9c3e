#pragma once
// Samples whose memory is used again: to get and clear fresh memory for a state of a thousand components takes as long as to
// read it.
#include <concepts>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "idl/common/cdr.h"

namespace takt::client {

/// Of a message, or of what adds to it. Any thread. Its samples may outlive it.
template <Message Type, std::derived_from<Type> Sample = Type>
class SamplePool {
 public:
  using Clean = void (*)(Sample&);
  /// A larger sample than this is not kept.
  static constexpr std::size_t kLargest_bytes = 1U << 20U;

  /// Keeps up to `most` samples that are not in use. `clean` is called as one comes back.
  explicit SamplePool(std::size_t most, Clean clean = nullptr)
      : unused_(std::make_shared<Unused>(most, clean)) {}

  /// A sample to be written all over: its content is that of an earlier one, or of a fresh one. It comes back when the last
  /// pointer to it goes.
  std::shared_ptr<Sample> take() {
    return {unused_->take().release(),
            [unused = unused_](Sample* sample) { unused->put(std::unique_ptr<Sample>(sample)); }};
  }

 private:
  class Unused {
   public:
    Unused(std::size_t most, Clean clean) : most_(most), clean_(clean) { samples_.reserve(most); }
    std::unique_ptr<Sample> take() {
      const std::lock_guard lock(mutex_);
      if (samples_.empty()) return std::make_unique<Sample>();
      auto newest = std::move(samples_.back());  // whose memory may still be in the processor's cache
      samples_.pop_back();
      return newest;
    }
    void put(std::unique_ptr<Sample> sample) {
      if (most_ == 0 || cdr::size<Type>(*sample) > kLargest_bytes) return;
      if (clean_ != nullptr) clean_(*sample);
      const std::lock_guard lock(mutex_);
      if (samples_.size() < most_) samples_.push_back(std::move(sample));
    }

   private:
    const std::size_t most_;
    const Clean clean_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<Sample>> samples_;
  };
  std::shared_ptr<Unused> unused_;
};

}  // namespace takt::client
