#pragma once
// Signals of a recording over time, by name: state.components.P.position.z, power.Robot1.electrical_power,
// ... The first part is the topic, without the cell's name.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/sample.h"

namespace takt::recording {

/// /cell/Robot1/joint_states -> Robot1/joint_states; /clock -> clock.
std::string short_topic(const std::string& topic);

/// Simulated time of a sample: its member `time`, or its stamp. Empty for a sample without a time.
std::optional<double> sample_time_s(const Json& sample);

struct SignalValue {
  std::string name;
  double value = 0.0;
};

/// The requested signals of one sample.
struct SignalSample {
  std::string topic;        ///< short
  double time_s = 0.0;      ///< simulated; without one in the sample, the time of the recording
  std::uint32_t epoch = 0;  ///< 0 if the sample has no epoch
  std::vector<SignalValue> values;
};

/// Calls the function for the first description of a cell in the recording, if there is one. A recorder may receive samples
/// ahead of the description that names their elements. Throws RecordingError.
void with_first_description(McapReader& recording, const std::function<void(const McapMessage&)>& function);

/// Calls the function for every sample with signals that fit one of the patterns (* for any characters).
/// Throws RecordingError.
void read_signals(McapReader& recording, const std::vector<std::string>& patterns,
                  const std::function<void(const SignalSample&)>& function);

/// Names of all signals that fit a pattern, in the order of their first samples.
std::vector<std::string> signal_names(McapReader& recording, const std::vector<std::string>& patterns);

}  // namespace takt::recording
