#pragma once
// In lockstep the loop's own thread writes the instants: the loop waits for the answers anyway, and a hand-over to another
// thread costs two changes of thread for each exchange.
#include <mutex>

namespace takt {

/// Sends the newest snapshot of LoopOutput, in the thread that calls it.
class InstantWriter {
 public:
  virtual void write_instant() = 0;

 protected:
  ~InstantWriter() = default;
};

/// The writer, while an adapter is attached. Any thread.
class InstantWriterSlot {
 public:
  /// nullptr: none. Returns when the writer that was there is not in use any more. The caller holds no lock that
  /// write_instant() takes.
  void set(InstantWriter* writer) {
    const std::lock_guard lock(mutex_);
    writer_ = writer;
  }
  /// False without a writer.
  bool write() {
    const std::lock_guard lock(mutex_);
    if (writer_ == nullptr) return false;
    writer_->write_instant();
    return true;
  }

 private:
  std::mutex mutex_;
  InstantWriter* writer_ = nullptr;
};

}  // namespace takt
