// Progress and cancellation of long work.
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <thread>

namespace beamspread {

// Counts finished work from any thread and reports its fraction through a callback on the thread that made the object.
// After a callback that returns false, every `advance` throws Cancelled; after one that throws, it throws the same.
class Progress {
public:
    using Callback = std::function<bool(double)>;

    // Without a callback, work is neither reported nor cancellable.
    explicit Progress(Callback callback = {});
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    // Starts a job of `total` units of work (> 0) and reports 0; throws Cancelled.
    void set_total(double total);

    // Adds finished work; throws Cancelled.
    void advance(double work);

    // Calls `step` with a progress of its own, which is `work` of this one.
    void advance_by(double work, const std::function<void(Progress&)>& step);

    // Reports 1; throws Cancelled.
    void finish();

private:
    void report(double fraction);
    [[noreturn]] void stop() const;

    Callback m_callback;
    std::thread::id m_owner;
    double m_total = 1.0;
    std::atomic<double> m_done{0.0};
    std::exception_ptr m_error;  // of the callback; set before m_cancelled
    std::atomic<bool> m_cancelled{false};
    std::chrono::steady_clock::time_point m_last_report{};
};

}  // namespace beamspread
