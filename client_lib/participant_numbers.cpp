#include "client_lib/participant_numbers.h"

#include <numeric>
#include <random>
#include <utility>

namespace takt::client {

ParticipantNumbers& ParticipantNumbers::of_process() {
  static ParticipantNumbers numbers;
  return numbers;
}

ParticipantNumbers::ParticipantNumbers() : fresh_(kCount) {
  std::iota(fresh_.begin(), fresh_.end(), kSmallest);
}

int ParticipantNumbers::draw() {
  const std::lock_guard lock(mutex_);
  int number = -1;
  if (!fresh_.empty()) {
    std::random_device chance;  // not the same in a process that was forked
    std::swap(fresh_[chance() % fresh_.size()], fresh_.back());
    number = fresh_.back();
    fresh_.pop_back();
  } else if (!used_.empty()) {
    number = used_.front();
    used_.pop_front();
  }
  return number;
}

void ParticipantNumbers::give_back(int number) {
  if (number < 0) return;
  const std::lock_guard lock(mutex_);
  used_.push_back(number);
}

}  // namespace takt::client
