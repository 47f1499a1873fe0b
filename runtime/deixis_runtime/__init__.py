"""What every Deixis stage runs on: session, loop, health, configuration, supervisor"""
