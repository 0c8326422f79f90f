//! Real-time scheduling, where the system permits it.

/// Puts this thread, and no other, under the system's real-time scheduling (SCHED_FIFO). True: it is; false: not permitted, or unknown to
/// the system.
pub fn ask_for() -> bool {
    #[cfg(target_os = "linux")]
    {
        use thread_priority::unix::{
            RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
        };
        use thread_priority::{ThreadPriority, ThreadPriorityValue};
        // Above what is not real-time, below what the system itself needs.
        let priority = ThreadPriorityValue::try_from(20u8).map(ThreadPriority::Crossplatform);
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        priority.is_ok_and(|priority| set_thread_priority_and_policy(thread_native_id(), priority, policy).is_ok())
    }
    #[cfg(not(target_os = "linux"))]
    false
}
