#pragma once
// A recording as a stream: play, pause and seek at any rate. The place in the recording is a channel of its own
// (takt_player::msg::Playback).
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client_lib/recording/mcap_reader.h"
#include "client_lib/view/stream.h"
#include "takt_player_table.h"

namespace takt::view {

class FileSource {
 public:
  /// The stream must outlive this. Throws RecordingError.
  FileSource(const std::filesystem::path& file, Stream& stream);
  ~FileSource();
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  const recording::McapReader& recording() const { return reader_; }

  /// set_state, set_pace, reset, as of a running cell, and seek (idl/takt_player.idl).
  Answer request(const std::string& name, const Arguments& arguments);

 private:
  struct Kept {
    std::uint64_t time_ns = 0;
    std::string sample;
  };
  void look_through();
  void publish_events();
  void run();
  void show(std::unique_lock<std::mutex>& lock, std::uint64_t seen);
  void play_on(std::unique_lock<std::mutex>& lock);
  void show_instant(std::uint64_t position_ns);
  void publish_position();
  // With the lock.
  template <Request... Types>
  Answer execute_one_of(const std::string& name, const Arguments& arguments);
  Answer execute(const requests::SetState& request);
  Answer execute(const requests::SetPace& request);
  Answer execute(const requests::Reset& request);
  Answer execute(const player::Seek& request);
  Answer done(const std::string& sentence);
  void seek(double position_s);
  double duration_s() const { return 1e-9 * static_cast<double>(reader_.last_ns() - reader_.first_ns()); }

  Stream& stream_;
  recording::McapReader reader_;  ///< after construction of the playing thread only
  std::map<std::uint16_t, std::uint32_t> channels_;
  std::uint32_t playback_channel_ = 0;
  std::map<std::uint16_t, std::vector<Kept>> kept_;  ///< latched topics and events, whole

  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false, playing_ = true, sought_ = true;
  double rate_ = 1.0;
  std::uint64_t position_ns_ = 0;
  std::string problem_;        ///< reason why the playback ended, or empty
  std::uint64_t changes_ = 0;  ///< counts requests
  std::thread thread_;
};

}  // namespace takt::view
