package ruedo;

/** A transport of messages. Thread safe, also within the receiver. */
interface Transport {
    /**
     * Called by the transport's own thread, one message at a time. What it throws does not end that
     * thread.
     */
    interface Receiver {
        /** Whether anybody listens to that channel; otherwise its messages are skipped. */
        boolean wants(String channel);

        /** Called before the thread waits; returns the longest time to wait, ms. */
        long beforeTurn();

        /** message: all of its bytes, the receiver's from now on. */
        void receive(String channel, byte[] message);
    }

    /** Throws NoServer, with the cure, when nothing can come from there. */
    static Transport open(Address address) {
        address.checkReachable();
        return address.multicast ? new UdpmTransport(address) : new StreamTransport(address);
    }

    /** Begins to receive. */
    void start(Receiver receiver);

    /** After it returns, every message of that channel is received. */
    void subscribe(String channel);

    void unsubscribe(String channel);

    /** A datagram that cannot be sent is lost, as any may be; unanswered requests are repeated. */
    void publish(String channel, byte[] message);

    /** Whether a message waits for the receiver, or it has not seen all of one yet. */
    default boolean hasNews() {
        return false;
    }

    /** False: nothing can be sent, since there is no server. */
    default boolean isConnected() {
        return true;
    }

    void close();
}
