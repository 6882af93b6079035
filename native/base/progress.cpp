#include "base/progress.h"

#include <algorithm>
#include <utility>

#include "base/error.h"

namespace beamspread {

namespace {
// Time between two reports. Longer: less time in the host's interpreter, a coarser bar and a slower Esc.
constexpr std::chrono::milliseconds report_interval{50};
}  // namespace

Progress::Progress(Callback callback) : m_callback(std::move(callback)), m_owner(std::this_thread::get_id()) {}

void Progress::set_total(double total)
{
    m_total = total;
    m_done = 0.0;
    report(0.0);
}

void Progress::advance(double work)
{
    const double done = m_done.fetch_add(work) + work;
    if (m_cancelled)
        stop();
    if (std::this_thread::get_id() != m_owner)
        return;
    if (std::chrono::steady_clock::now() - m_last_report >= report_interval)
        report(std::clamp(done / m_total, 0.0, 1.0));
}

void Progress::advance_by(double work, const std::function<void(Progress&)>& step)
{
    double done = 0.0;
    Progress part([&](double fraction) {
        advance(work * std::max(fraction - done, 0.0));
        done = std::max(done, fraction);
        return true;
    });
    step(part);
    advance(work * (1.0 - done));
}

void Progress::finish()
{
    report(1.0);
}

void Progress::report(double fraction)
{
    if (!m_callback)
        return;
    m_last_report = std::chrono::steady_clock::now();
    try {
        if (!m_callback(fraction))
            m_cancelled = true;
    } catch (...) {
        // All threads stop with the same exception; the loop rethrows the first.
        m_error = std::current_exception();
        m_cancelled = true;
    }
    if (m_cancelled)
        stop();
}

void Progress::stop() const
{
    if (m_error)
        std::rethrow_exception(m_error);
    throw Cancelled();
}

}  // namespace beamspread
