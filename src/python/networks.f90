! SPDX-License-Identifier: MIT
!> Joint networks of a session: the lines that joint statistics give.
module rockdda_python_networks
   use rockdda_base_error, only : error_code, make_error
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_io_recognise, only : file_kind
   use rockdda_io_source, only : source_type, new_source
   use rockdda_io_statistics_file, only : read_statistics_file, read_statistics_source
   use rockdda_run_find_files, only : recognise_file
   use rockdda_python_session, only : session_type
   implicit none
   private
   public :: draw_network_of_file, draw_network_of_text

contains

   !> Draw the lines of a joint statistics file.
   subroutine draw_network_of_file(session, path, seed)
      type(session_type), intent(inout) :: session
      character(len=*), intent(in) :: path
      integer, intent(in) :: seed                        !! -1: that of the file
      type(statistics_type) :: statistics
      integer :: kind
      logical :: ok
      call recognise_file(path, kind, session%messages, ok)
      if (ok .and. kind /= file_kind%statistics) &
         call make_error(session%error, error_code%input, path//': error: expected a joint statistics file')
      if (session%status() == 0) call read_statistics_file(path, statistics, session%messages)
      call draw(session, statistics, seed)
   end subroutine draw_network_of_file

   !> The same from text in memory.
   subroutine draw_network_of_text(session, name, text, seed)
      type(session_type), intent(inout) :: session
      character(len=*), intent(in) :: name, text         !! name: for messages
      integer, intent(in) :: seed                        !! -1: that of the text
      type(statistics_type) :: statistics
      type(source_type) :: source
      call new_source(name, text, source)
      call read_statistics_source(source, statistics, session%messages)
      call draw(session, statistics, seed)
   end subroutine draw_network_of_text

   !> Statistics to lines.
   subroutine draw(session, statistics, seed)
      type(session_type), intent(inout) :: session
      type(statistics_type), intent(inout) :: statistics
      integer, intent(in) :: seed
      if (session%status() /= 0) return
      if (seed >= 0) statistics%seed = seed
      call generate_lines(statistics, session%input%geometry, session%drawn, session%messages)
   end subroutine draw

end module rockdda_python_networks
