package ruedo.lcmtypes;

import lcm.lcm.LCMEncodable;

import java.io.DataInput;
import java.io.IOException;

/**
 * What all message types here can do. They are LCM's, too: {@code lcm.publish(channel, message)} of
 * LCM's own library takes them.
 */
public interface Message extends LCMEncodable {
    /** Reads the fields alone. */
    void _decodeRecursive(DataInput in) throws IOException;
}
